r"""A software TMCM-341/342/343: module, firmware V4.36, chips, and the tools beside it.

The names in `__all__` are for users' tests and tools (docs/api.md); what they need is imported when they are used.

    import tmcm34x

    run = tmcm34x.run_program("MVP ABS, 0, 5000\nWAIT POS, 0, 0\nSTOP\n")
    print(run.ending, run.rig.now / tmcm34x.HZ)
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False
"""As `typing` has it, which is imported later."""
if TYPE_CHECKING:
    from typing import Any

    from tmcm34x import sweep
    from tmcm34x.bench.builder import load as load_bench
    from tmcm34x.bench.rig import BenchError, Rig, simple_rig
    from tmcm34x.bench.run import Run
    from tmcm34x.clock import HZ, clocks, run_until, seconds
    from tmcm34x.debug.branches import HistoryError
    from tmcm34x.host.exceptions import HostError
    from tmcm34x.host.module import Module, connect
    from tmcm34x.testing import register_url
    from tmcm34x.testing.history import History
    from tmcm34x.testing.programs import run_program
    from tmcm34x.testing.virtual import VirtualModule
    from tmcm34x.tmcl.datagram import Instruction, Reply
    from tmcm34x.tmcl.mnemonic import format_instruction, parse_instruction
    from tmcm34x.toolchain.assembler import assemble
    from tmcm34x.toolchain.disassembler import disassemble

__version__ = "0.1.0"

__all__ = [
    "HZ",
    "BenchError",
    "History",
    "HistoryError",
    "HostError",
    "Instruction",
    "Module",
    "Reply",
    "Rig",
    "Run",
    "VirtualModule",
    "__version__",
    "assemble",
    "clocks",
    "connect",
    "disassemble",
    "format_instruction",
    "load_bench",
    "parse_instruction",
    "register_url",
    "run_program",
    "run_until",
    "seconds",
    "simple_rig",
    "sweep",
]

_HOMES = {
    "HZ": "clock",
    "BenchError": "bench.rig",
    "History": "testing.history",
    "HistoryError": "debug.branches",
    "HostError": "host.exceptions",
    "Instruction": "tmcl.datagram",
    "Module": "host.module",
    "Reply": "tmcl.datagram",
    "Rig": "bench.rig",
    "Run": "bench.run",
    "VirtualModule": "testing.virtual",
    "assemble": "toolchain.assembler",
    "clocks": "clock",
    "connect": "host.module",
    "disassemble": "toolchain.disassembler",
    "format_instruction": "tmcl.mnemonic",
    "load_bench": "bench.builder:load",
    "parse_instruction": "tmcl.mnemonic",
    "register_url": "testing",
    "run_program": "testing.programs",
    "run_until": "clock",
    "seconds": "clock",
    "simple_rig": "bench.rig",
    "sweep": "sweep:",
}
"""The module of each name, and behind a colon its name there; nothing behind it for the module itself."""


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    path, colon, inner = home.partition(":")
    module = import_module(f"{__name__}.{path}")
    value = module if colon and not inner else getattr(module, inner or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
