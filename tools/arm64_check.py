"""Whether the monitor's kernels can run on ARM64: `make arm64` compiles each for a Cortex-A53.

Numba compiles for the processor at hand. Here the same intermediate code goes through LLVM's
backend for AArch64 (the four A53 cores of C-230); nothing in it may ask for x86 instructions. That
says that the code exists and fits, not how fast it is or that it was run there.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile

FOLDER = tempfile.TemporaryDirectory()
os.environ["NUMBA_CACHE_DIR"] = FOLDER.name  # what comes from a cache cannot be looked into

import llvmlite.binding as llvm  # noqa: E402
from numba.core.registry import CPUDispatcher  # noqa: E402

from skidpad.live.child import warm_up  # noqa: E402

TRIPLE, PROCESSOR = "aarch64-unknown-linux-gnu", "cortex-a53"
OF_THIS_MACHINE = re.compile(
    r'"target-(?:cpu|features)"="[^"]*"|target (?:triple|datalayout) = .*| immarg'
)
X86 = re.compile(r"llvm\.x86\.[\w.]+")
ATOMIC = "llvm.x86.atomic."  # what x86's backend makes of a portable atomic count of references


def kernels() -> list[tuple[str, CPUDispatcher]]:
    """Every kernel of the channels' evidence that a monitored cycle has called."""
    found = {}
    for module in [m for m in sys.modules if m.startswith("skidpad.evidence.channels")]:
        for name, value in vars(sys.modules[module]).items():
            if isinstance(value, CPUDispatcher) and value.overloads:
                found[id(value)] = (f"{value.py_func.__module__}.{name}", value)
    return sorted(found.values(), key=lambda row: row[0])


def main() -> int:
    """Compile all; prints one line per kernel."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(cpu=PROCESSOR)
    warm_up(("a", "b"))
    failed = 0
    for name, kernel in kernels():
        for text in kernel.inspect_llvm().values():
            text = OF_THIS_MACHINE.sub("", text).replace(ATOMIC, "portable_atomic_")
            if foreign := sorted(set(re.findall(X86, text))):
                failed += 1
                print(f"{name}: asks for {', '.join(foreign)}")
                continue
            module = llvm.parse_assembly(text)
            module.triple, module.data_layout = TRIPLE, str(machine.target_data)
            print(f"{name}: {len(machine.emit_object(module))} bytes for {PROCESSOR}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
