"""A bench: modules on one line with motors, loads, switches, encoders and signals, from a TOML file or by default.

rig = load("examples/benches/xy-stage.toml")
run_until(rig, clock.clocks(2.0))
rig.worlds[0].view()
"""

from tmcm34x.bench.rig import Rig, simple_rig
from tmcm34x.bench.world import AxisView, World

__all__ = ["AxisView", "Rig", "World", "simple_rig"]
