"""The compiled core: the same source, in a wheel."""

import os
import re
import subprocess
import sys
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
WALL_CLOCK = re.compile(r" in [\d.]+ s, [\d,]+ times real time")
PROGRAM = ROOT / "examples" / "three_axes.tmc"


def output(*command, **options) -> str:
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    """The command of a wheel with a compiled core, in an environment of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    environment = {"TMCM34X_CORE": "compiled", "TMCM34X_CORE_LEVEL": "0", "PATH": "/usr/bin:/bin"}
    output(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT, env=environment)
    (wheel,) = folder.glob("*.whl")
    assert "py3-none-any" not in wheel.name
    venv.create(folder / "venv", with_pip=False, symlinks=True)
    (site,) = (folder / "venv" / "lib").glob("*/site-packages")
    libraries = next(path for path in sys.path if path.endswith("site-packages"))
    (site / "libraries.pth").write_text(f"{libraries}\n")
    output(sys.executable, "-m", "pip", "install", "--no-deps", "--quiet", "--target", site, wheel)
    return folder / "venv" / "bin" / "python"


def test_a_wheel_holds_the_compiled_core_and_says_so(installed):
    assert "core: compiled" in output(installed, "-m", "tmcm34x", "--version", "--verbose", cwd="/")


def test_both_cores_run_a_program_alike(installed):
    arguments = ("-m", "tmcm34x", "run", PROGRAM, "--until", "3")
    compiled, pure = (output(python, *arguments, cwd="/") for python in (installed, sys.executable))
    assert WALL_CLOCK.sub("", compiled) == WALL_CLOCK.sub("", pure)


def test_an_installation_in_place_says_which_core_it_has():
    text = output(sys.executable, "-m", "tmcm34x", "--version", "--verbose")
    assert text.splitlines()[1] in {"core: Python", "core: compiled"}


SOAK = """
from test_soak import Soak
for model in (341, 342, 343):
    soak = Soak(model, seed=15)
    soak.play(0.02)
    print(model, soak.operations, soak.digest.hexdigest(), soak.rig.digest())
"""


def test_both_cores_go_through_random_activity_byte_for_byte_alike(installed):
    paths = os.pathsep.join(map(str, (ROOT / "tests", ROOT / "docs")))
    runs = [
        output(python, "-c", SOAK, cwd="/", env={"PYTHONPATH": paths})
        for python in (installed, sys.executable)
    ]
    assert runs[0] == runs[1]
    assert len(runs[0].splitlines()) == 3
