"""Train the camera driver's network and write it as ONNX.

    python -m camera_agent.train DATA OUT.onnx [EPOCHS]

DATA holds train/ and val/ as `collect` writes them. Needs torch (CPU is enough) and onnx, which the
package itself does not; what it ships is OUT.onnx, read by OpenCV.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

from skidpad.stack.camera.codes import OUTPUTS

CHANNELS = (3, 16, 24, 40, 56)
KERNELS = (5, 3, 3, 3)
FLAT = 56 * 6 * 8
HIDDEN = 128
BATCH, RATE, DECAY = 96, 2e-3, 1e-4
OPSET = 11
OFFSETS = OUTPUTS - 2


def network() -> nn.Sequential:
    """Four convolutions with stride 2, two full layers; input (n, 3, 96, 128)."""
    layers: list[nn.Module] = []
    for k, size in enumerate(KERNELS):
        layers += [nn.Conv2d(CHANNELS[k], CHANNELS[k + 1], size, 2, size // 2), nn.ReLU()]
    layers += [nn.Flatten(), nn.Linear(FLAT, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, OUTPUTS)]
    return nn.Sequential(*layers)


def loss_of(said: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
    """Smooth L1 of offsets and of nearness where somebody is, cross entropy of presence."""
    offsets = nn.functional.smooth_l1_loss(said[:, :OFFSETS], wanted[:, :OFFSETS], beta=0.1)
    present = wanted[:, -2]
    matters = (present != 0.5).float()
    entropy = nn.functional.binary_cross_entropy_with_logits(said[:, -2], present, weight=matters)
    there = (present > 0.0).float()
    near = nn.functional.smooth_l1_loss(said[:, -1], wanted[:, -1], beta=0.05, reduction="none")
    return 4.0 * offsets + 0.3 * entropy + 4.0 * (near * there).mean()


def batch_of(
    images: Any, labels: Any, rows: Any, rng: np.random.Generator | None
) -> tuple[torch.Tensor, torch.Tensor]:
    """A batch; with `rng` half of it mirrored, and brightness and contrast a little different."""
    x = torch.from_numpy(images[rows]).permute(0, 3, 1, 2).float() / 255.0 - 0.5
    y = torch.from_numpy(labels[rows]).clone()
    if rng is not None:
        flip = torch.from_numpy(rng.random(len(rows)) < 0.5)
        x[flip] = torch.flip(x[flip], dims=[3])
        y[flip, :OFFSETS] *= -1.0
        gain = torch.from_numpy(rng.uniform(0.85, 1.15, (len(rows), 1, 1, 1)).astype(np.float32))
        shift = torch.from_numpy(rng.uniform(-0.06, 0.06, (len(rows), 1, 1, 1)).astype(np.float32))
        x = x * gain + shift
    return x, y


def validate(net: nn.Module, images: Any, labels: Any) -> str:
    """Errors in words."""
    net.eval()
    with torch.no_grad():
        said = torch.cat(
            [net(batch_of(images, labels, np.arange(k, min(k + 256, len(labels))), None)[0])
             for k in range(0, len(labels), 256)]
        ).numpy()  # fmt: skip
    net.train()
    ahead = np.array((6.0, 12.0, 20.0, 30.0, 45.0))
    metres = np.median(np.abs(said[:, :OFFSETS] - labels[:, :OFFSETS]) * ahead / 8.0, axis=0)
    there, seen = labels[:, -2] == 1.0, said[:, -2] > 0.0
    gap = 8.0 / labels[there & seen, -1] - 6.0
    error = np.abs(8.0 / np.maximum(said[there & seen, -1], 1e-3) - 6.0 - gap) / (gap + 2.0)
    false = seen[labels[:, -2] == 0.0].mean()
    near = there & (labels[:, -1] > 8.0 / 36.0)
    return (
        f"offsets m {np.round(metres, 3)}; missed {1 - seen[there].mean():.3f} (below 30 m "
        f"{1 - seen[near].mean():.3f}), false {false:.3f}, gap error {np.median(error):.3f}"
    )


def train(data: Path, out: Path, epochs: int) -> None:
    """Train and write."""
    torch.manual_seed(1)
    torch.set_num_threads(1)  # two share caches and win nothing here
    rng = np.random.default_rng(1)
    images, labels = (
        np.load(data / "train" / f"{n}.npy", mmap_mode="r") for n in ("images", "labels")
    )
    held = tuple(np.load(data / "val" / f"{n}.npy", mmap_mode="r") for n in ("images", "labels"))
    net = network()
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    steps = epochs * (len(labels) // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, RATE, total_steps=steps, pct_start=0.1
    )
    for epoch in range(epochs):
        began, total = time.time(), 0.0
        order = rng.permutation(len(labels))
        for k in range(len(labels) // BATCH):
            x, y = batch_of(images, labels, np.sort(order[k * BATCH : (k + 1) * BATCH]), rng)
            with torch.autocast("cpu", torch.bfloat16):
                said = net(x)
            loss = loss_of(said.float(), y)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            total += loss.item()
        mean = total / (len(labels) // BATCH)
        print(
            f"epoch {epoch}: loss {mean:.4f}, {time.time() - began:.0f} s; {validate(net, *held)}",
            flush=True,
        )
        write_onnx(net, out)


def write_onnx(net: nn.Sequential, out: Path) -> None:
    """The network as a plain ONNX graph, batch 1, that any reader takes."""
    nodes, weights, name = [], [], "image"
    for k, layer in enumerate(net):
        made = f"x{k}"
        if isinstance(layer, (nn.Conv2d, nn.Linear)):
            for part in ("weight", "bias"):
                value = getattr(layer, part).detach().numpy()
                weights.append(numpy_helper.from_array(value, f"{part}{k}"))
            inputs = [name, f"weight{k}", f"bias{k}"]
            if isinstance(layer, nn.Conv2d):
                size, pad = layer.kernel_size[0], int(layer.padding[0])
                nodes.append(
                    helper.make_node("Conv", inputs, [made], kernel_shape=[size, size],
                                     strides=[2, 2], pads=[pad] * 4)
                )  # fmt: skip
            else:
                nodes.append(helper.make_node("Gemm", inputs, [made], transB=1))
        elif isinstance(layer, nn.ReLU):
            nodes.append(helper.make_node("Relu", [name], [made]))
        else:
            nodes.append(helper.make_node("Flatten", [name], [made]))
        name = made
    shape = helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, 96, 128])
    said = helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, OUTPUTS])
    graph = helper.make_graph(nodes, "camera driver", [shape], [said], weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)])
    model.ir_version = 7
    onnx.checker.check_model(model)
    onnx.save(model, out)


if __name__ == "__main__":
    train(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 12)
