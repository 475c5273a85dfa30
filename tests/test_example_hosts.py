"""The worked examples of host software, as a user runs them, and what goes with them into CI."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
HOSTS = ROOT / "examples" / "hosts"
QUICKLY = [f"-pno:{name}" for name in ("cacheprovider", "hypothesispytest", "benchmark", "anyio")]
TESTS = sorted([*HOSTS.glob("test_*.py"), *HOSTS.glob("*.session")])


def command(name, *arguments):
    program = Path(sys.executable).with_name(name)
    return subprocess.run([program, *arguments], cwd=HOSTS, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("path", TESTS, ids=lambda path: path.name)
def test_the_example_runs(path):
    result = command("pytest", *QUICKLY, "-q", "-rs", "-c", "/dev/null", "--rootdir", ".", path.name)
    assert result.returncode == 0, result.stdout


def test_the_session_is_played_too():
    assert command("tmcm34x", "play", "homing.session").returncode == 0


def test_the_workflow_is_one():
    result = command("check-jsonschema", "--builtin-schema", "vendor.github-workflows", "github-workflow.yml")
    assert result.returncode == 0, result.stdout


def test_the_dockerfile_has_nothing_to_mend():
    result = command("hadolint", "--no-color", "Dockerfile")
    assert (result.returncode, result.stdout) == (0, "")


def test_the_health_check_of_the_dockerfile_tells_whether_a_module_answers(serve):
    """Its Python one-liner, on another port."""
    (line,) = [
        row for row in (HOSTS / "Dockerfile").read_text().splitlines() if "CMD [" in row and "python" in row
    ]
    code = line.split('"')[5]
    served = serve("--tcp=0")
    healthy = [sys.executable, "-c", code.replace("127.0.0.1:17000", served.tcp)]
    assert subprocess.run(healthy, capture_output=True, check=False).returncode == 0
    served.stop()
    assert subprocess.run(healthy, capture_output=True, check=False).returncode != 0
