"""The lint of kernels finds each thing that does not compile for a GPU, and nothing else."""

from __future__ import annotations

import pytest

from kernel_lint import violations, writes_held

HEAD = "@kernel\ndef f(x: Floats, out: Floats) -> float:\n    "


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("near = np.empty(64)", "np.empty"),
        ("return np.sqrt(x[0])", "np.sqrt"),
        ("return x.sum()", ".sum"),
        ("return float(np.any(x > 1.0))", "np.any"),
        ("span = [0.0, 1.0]", "List allocates"),
        ("return max(v for v in x)", "GeneratorExp allocates"),
    ],
)
def test_what_a_kernel_may_not_do(body: str, reason: str) -> None:
    assert list(violations(HEAD + body)) == [(3, f"f: {reason}")]


@pytest.mark.parametrize(
    "body",
    [
        "out[0] = np.float64(np.uint64(3)) + np.inf",
        "out.fill(0.0)",
        "return sqrt(x[0])",
        "table.add(out, 3)",
    ],
)
def test_what_it_may(body: str) -> None:
    assert not list(violations(HEAD + body))


def test_only_kernels_are_held_to_it() -> None:
    assert not list(violations("def f(x):\n    return np.empty(64)"))


@pytest.mark.parametrize("body", ["x.value = out", "x.value += 1", "x.value, y = out, 2"])
def test_no_kernel_replaces_what_is_held(body: str) -> None:
    assert list(writes_held(HEAD + body)) == [(3, "f: .value is replaced")]


@pytest.mark.parametrize("body", ["y = x.value", "x.value[0] = 1.0", "x.values = out"])
def test_what_is_held_may_be_read_and_its_arrays_written(body: str) -> None:
    assert not list(writes_held(HEAD + body))
