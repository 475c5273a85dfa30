"""A bench: modules on one line with motors, loads, switches, encoders and signals, from a TOML file or by default.

Example::

    rig = load("examples/benches/xy-stage.toml")
    run_until(rig, clock.clocks(2.0))
    rig.worlds[0].view()

What reads bench files is imported when it is used: `simple_rig` starts fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tmcm34x.bench.mount import AxisView
from tmcm34x.bench.rig import BenchError, Rig, simple_rig
from tmcm34x.bench.world import World

if TYPE_CHECKING:
    from tmcm34x.bench.builder import build, load

__all__ = ["AxisView", "BenchError", "Rig", "World", "build", "load", "simple_rig"]


def __getattr__(name: str) -> Any:
    if name in {"build", "load"}:
        return getattr(import_module("tmcm34x.bench.builder"), name)
    raise AttributeError(name)
