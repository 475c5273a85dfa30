"""A repository that is not ours: a fresh environment with the wheel, a driver, its tests, and three bugs to find."""

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
QUICKLY = [f"-pno:{name}" for name in ("cacheprovider", "hypothesispytest", "benchmark", "anyio", "xdist")]
DRIVER = (ROOT / "examples" / "hosts" / "driver.py").read_text()
TESTS = """
import pytest
import serial
from driver import Driver, RefusedError


@pytest.fixture
def driver(tmcm343):
    with serial.Serial(tmcm343.port, 9600, timeout=5) as port:
        yield Driver(port, sleep=tmcm343.run)


def test_a_move_has_ended_when_move_to_returns(driver, tmcm343):
    target = driver.position(0) + 2000
    driver.move_to(0, target)
    assert driver.position(0) == target


def test_a_refusal_is_an_error(driver):
    with pytest.raises(RefusedError):
        driver.set_max_speed(0, 5000)


def test_a_damaged_reply_is_asked_for_again(driver, tmcm343):
    tmcm343.fault("bad_checksum", count=1)
    assert driver.command(6, 4, 0) == 1000
"""
MOVE, REFUSAL, DAMAGED = (
    "test_a_move_has_ended_when_move_to_returns",
    "test_a_refusal_is_an_error",
    "test_a_damaged_reply_is_asked_for_again",
)
BUGS = {
    "no retry after a damaged reply": ("for _ in range(1 + self.retries):", "for _ in range(1):", DAMAGED),
    "takes position reached before the move began": (
        "        self.command(MVP, 0, motor, position)\n"
        "        self.wait(lambda: self.command(GAP, POSITION_REACHED, motor), timeout)",
        "        reached = self.command(GAP, POSITION_REACHED, motor)\n"
        "        self.command(MVP, 0, motor, position)\n"
        "        self.wait(lambda: reached, timeout)",
        MOVE,
    ),
    "ignores status 4": ("if reply[2] != OK:", "if reply[2] not in (OK, 4):", REFUSAL),
}


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The interpreter of a fresh environment in which the wheel is installed; its dependencies are those of ours."""
    folder = tmp_path_factory.mktemp("environment")
    environment = {**os.environ, "TMCM34X_CORE": "python"}
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    build = [*pip, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, ROOT]
    subprocess.run(build, check=True, env=environment)
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "venv", symlinks=True)
    interpreter = folder / "venv" / "bin" / "python"
    subprocess.run([*pip, "--python", interpreter, "install", "--no-deps", "--no-index", wheel], check=True)
    (site,) = (folder / "venv" / "lib").glob("python*/site-packages")
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return interpreter


@pytest.fixture
def repository(tmp_path, python):
    """Call it with the text of the driver and options: what pytest says of each test."""

    def run(driver, *options):
        (tmp_path / "driver.py").write_text(driver)
        (tmp_path / "test_driver.py").write_text(TESTS)
        command = [python, "-m", "pytest", *QUICKLY, "-v", "-rA", *options]
        result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert result.returncode in {0, 1}, result.stdout + result.stderr
        rows = [
            row.split("::")[1].split()
            for row in result.stdout.splitlines()
            if row.startswith("test_driver.py::")
        ]
        return {name: outcome for name, outcome, *_ in rows}

    return run


def test_the_plugin_is_that_of_the_wheel(python):
    code = "import tmcm34x.pytest_plugin as plugin; print(plugin.__file__)"
    result = subprocess.run([python, "-c", code], capture_output=True, text=True, check=True)
    assert str(python.parent.parent) in result.stdout


def test_a_good_driver_passes(repository):
    assert repository(DRIVER) == {MOVE: "PASSED", REFUSAL: "PASSED", DAMAGED: "PASSED"}


@pytest.mark.parametrize("bug", BUGS)
def test_a_planted_bug_is_found(repository, bug):
    good, bad, test = BUGS[bug]
    assert DRIVER.count(good) == 1
    outcomes = repository(DRIVER.replace(good, bad))
    assert [name for name, outcome in outcomes.items() if outcome == "FAILED"] == [test]


def test_the_same_tests_run_on_a_port_as_if_it_were_hardware(repository, serve):
    option = f"--tmcm34x-port={serve('--pty', '--speed', '5').pty}"
    assert repository(DRIVER, option) == {MOVE: "PASSED", REFUSAL: "PASSED", DAMAGED: "SKIPPED"}
    for good, bad, test in list(BUGS.values())[1:]:
        assert repository(DRIVER.replace(good, bad), option)[test] == "FAILED"
