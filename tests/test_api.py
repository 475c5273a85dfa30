"""The public names, and the examples of README and docs that are Python."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import tmcm34x

ROOT = Path(__file__).parent.parent
NAMES = """
    BenchError HZ History HistoryError HostError Instruction Module Reply Rig Run VirtualModule __version__ assemble
    clocks connect disassemble format_instruction load_bench parse_instruction register_url run_program run_until
    seconds simple_rig
    sweep
"""
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def test_the_public_names_are_these():
    assert sorted(tmcm34x.__all__) == NAMES.split()
    for name in tmcm34x.__all__:
        assert getattr(tmcm34x, name) is not None
        assert f"`{name}" in (ROOT / "docs" / "api.md").read_text()
    assert set(tmcm34x.__all__) <= set(dir(tmcm34x))
    with pytest.raises(AttributeError, match="has no attribute 'modul'"):
        _ = tmcm34x.modul


def test_importing_the_package_imports_nothing_else():
    code = "import sys, tmcm34x; print([name for name in sys.modules if name.startswith('tmcm34x.')])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def blocks(name, language):
    return [text for found, text in BLOCK.findall((ROOT / name).read_text()) if found == language]


@pytest.mark.parametrize("example", [*blocks("docs/api.md", "python"), *blocks("docs/sweeps.md", "python")])
def test_examples_of_the_interface_run(example):
    exec(compile(example, "example", "exec"), {"__name__": "example"})


def test_pyserial_opens_the_url_once_it_is_registered():
    code = """
import serial, sys, tmcm34x
try:
    serial.serial_for_url("tmcm34x://343")
except ValueError:
    tmcm34x.register_url()
with serial.serial_for_url("tmcm34x://343", timeout=1) as port:
    port.write(bytes((1, 136, 1, 0, 0, 0, 0, 0, 138)))
    print(port.read(9).hex())
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.startswith("020164880157042")


def test_run_program_tells_what_was_refused(tmp_path):
    run = tmcm34x.run_program("SAP 4, 0, 9999\nSTOP\n")
    ((error, count),) = run.refusals.items()
    assert (error.address, error.status, count) == (0, 4, 1)
    path = tmp_path / "program.tmc"
    path.write_text("Loop: JA Loop\n")
    assert tmcm34x.run_program(path, model=341, limit_s=2).module.board.model.number == 341
    with pytest.raises(ValueError, match="no command FOO"):
        tmcm34x.run_program("FOO\n")
    with pytest.raises(tmcm34x.BenchError):
        tmcm34x.run_program("STOP\n", bench="gone.toml")


def test_run_program_reads_sources_as_the_tool_chain_does(tmp_path):
    path = tmp_path / "program.tmc"
    path.write_bytes("// 5 °\n#include <SPEED.TMC>\n SAP 4, 0, Speed\n STOP\n".encode("utf-16"))
    (tmp_path / "speed.tmc").write_bytes("Speed = 321 // 5 °\n".encode("cp1252"))
    run = tmcm34x.run_program(path)
    assert run.rig.modules[0].execute(tmcm34x.parse_instruction("GAP 4, 0")) == (100, 321)


# README


def test_the_readmes_served_module_answers_its_host(serve_readme):
    """The shell example of README serves what its Python example connects to."""
    (example,) = [text for text in blocks("README.md", "python") if "pytrinamic" in text]
    served, port = serve_readme
    output = []
    exec(compile(example.replace("17000", port), "README.md", "exec"), {"print": output.append})
    assert output == ["343V4.36"]
    assert served.links[0][0] == "pty"


@pytest.fixture
def serve_readme(serve, tmp_path, monkeypatch):
    """What the README's first shell example starts, on a free port and with a link elsewhere."""
    monkeypatch.chdir(ROOT)
    (line,) = re.findall(r"\$ \.venv/bin/tmcm34x serve (.*)", (ROOT / "README.md").read_text())
    options = line.replace("17000", "0").replace("/tmp/", f"{tmp_path}/").split()
    served = serve(*options)
    return served, served.tcp.rpartition(":")[2]


def test_the_readmes_program_runs():
    (line,) = re.findall(r"\$ \.venv/bin/tmcm34x (run .*)", (ROOT / "README.md").read_text())
    command = [Path(sys.executable).with_name("tmcm34x"), *line.split()]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "simulated   3600.000000 s" in result.stdout


def test_the_readmes_test_passes(pytester):
    (example,) = [text for text in blocks("README.md", "python") if "def test_" in text]
    pytester.makepyfile(test_readme=example)
    quickly = [f"-pno:{name}" for name in ("cacheprovider", "hypothesispytest", "benchmark", "anyio")]
    result = pytester.runpytest_subprocess(*quickly)
    assert result.ret == 0
    assert result.parseoutcomes()["passed"] >= 1
