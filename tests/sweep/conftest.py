"""A small sweep in a folder."""

import pytest

SWEEP = """
program = "p.tmc"
bench = "bench.toml"
until_s = 100
[[vary]]
what = "Way"
values = [400, 800, 1600]
[[vary]]
what = "bench.module[0].axis[0].load.mass_kg"
name = "mass_kg"
values = [1.0, -1.0]
[figures]
distance = "distance[0]"
position = "ap[1][0]"
"""
PROGRAM = "Way = 1\n MVP ABS, 0, Way\n WAIT POS, 0, 0\n STOP\n"
BENCH = """
[[module]]
[[module.axis]]
load = { kind = "carriage", mass_kg = 1.0 }
"""


@pytest.fixture
def sweep_file(tmp_path):
    """Six rows, of which each second one fails because its bench cannot be built."""
    (tmp_path / "p.tmc").write_text(PROGRAM)
    (tmp_path / "bench.toml").write_text(BENCH)
    file = tmp_path / "sweep.toml"
    file.write_text(SWEEP)
    return file
