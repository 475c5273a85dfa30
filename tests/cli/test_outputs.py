"""`-` for standard output: what goes there is what would stand in a file, and no file has this name."""

import subprocess
import sys
from pathlib import Path

import pytest

from tmcm34x.cli import run

PROGRAM = "Start: MVP ABS, 0, 1000\nWAIT POS, 0, 0\nSTOP\n"
TEXTS = (
    "run program.tmc --csv OUT",
    "run program.tmc --vcd OUT",
    "run program.tmc --save-session OUT",
    "asm program.tmc -o OUT",
    "asm program.tmc -o program.bin --listing OUT",
    "asm program.tmc -o program.bin --symbols OUT",
    "asm program.tmc -o program.bin --emit-tmcl OUT",
    "dis image.bin -o OUT",
    "upload --port virtual:343 -o OUT",
    "settings dump --port virtual:343 OUT",
    "backup --port virtual:343 OUT",
)
FILES = (
    "run program.tmc --plot OUT",
    "run program.tmc --save-state OUT",
    "run program.tmc --coverage OUT",
    "sweep sweep.toml --out OUT",
    "sweep sweep.toml --parquet OUT",
    "sweep sweep.toml --picture OUT",
    "sweep sweep.toml --row 0 --plot OUT",
    "play session.txt --junit OUT",
    "show session.txt --to OUT",
    "record OUT --tcp 0 --to tcp:127.0.0.1:1",
    "serve --tcp 0 --eeprom OUT",
    "serve --tcp 0 --ready-file OUT",
    "serve --tcp 0 --record OUT",
    "ide --eeprom OUT",
)

SUFFIXES = {
    "--plot": ".svg",
    "--picture": ".svg",
    "--parquet": ".parquet",
    "show": ".pcapng",
    "record": ".pcapng",
}
"""By which the form of an output is known."""


@pytest.fixture
def tool(tmp_path, monkeypatch, capfdbinary):
    """Call it with a command line, or its words: gives exit status, standard output and standard error."""
    monkeypatch.chdir(tmp_path)
    Path("program.tmc").write_text(PROGRAM)
    Path("session.txt").write_text("== reads\n> GAP 4, 0\n< 100 1000\n")
    Path("sweep.toml").write_text(
        'program = "program.tmc"\nfigures = ["time_ms"]\n[[vary]]\nparameter = "max_speed"\nvalues = [100]\n'
    )
    assert run(["asm", "program.tmc", "-o", "image.bin"]) == 0
    capfdbinary.readouterr()

    def call(line):
        status = run(line if isinstance(line, list) else line.split())
        output, errors = capfdbinary.readouterr()
        assert not Path("-").exists()
        return status, output, errors.decode()

    return call


@pytest.mark.parametrize("line", TEXTS)
def test_standard_output_has_what_the_file_would_have(tool, line):
    status, output, errors = tool(line.replace("OUT", "-"))
    assert status == 0
    assert "Traceback" not in errors
    assert tool(line.replace("OUT", "out"))[0] == 0
    assert output or "upload" in line, "a fresh module has no program"
    assert without_dates(output) == without_dates(Path("out").read_bytes())


def without_dates(data):
    """What a recording holds, without the line that says when it was made."""
    return [line for line in data.splitlines() if b"$date" not in line]


@pytest.mark.parametrize("line", FILES)
def test_what_needs_a_file_of_its_own_says_so(tool, line):
    status, output, errors = tool(line.replace("OUT", "-"))
    assert (status, output, errors.count("\n")) == (2, b"", 1)


INPUTS = ("program.tmc", "image.bin", "sweep.toml", "session.txt")


@pytest.mark.parametrize("line", [line for line in TEXTS + FILES if line.split()[1] in INPUTS])
def test_no_output_writes_over_what_the_command_reads(tool, line):
    source = Path(line.split()[1])
    before = source.read_bytes()
    source.with_name("again").symlink_to(source)
    for name in (source.name, f"./{source.name}", "again"):
        status, _, errors = tool(line.replace("OUT", name))
        assert (status, errors.count("\n"), source.read_bytes()) == (2, 1, before), errors


def test_two_outputs_are_two_files(tool):
    assert tool("run program.tmc --csv out --vcd ./out")[::2] == (
        2,
        "tmcm34x run: out is both --csv and --vcd: what is written needs a file of its own\n",
    )
    assert tool("run program.tmc --csv /dev/null --vcd /dev/null")[0] == 0


CIRCLES = ("circle", "link")
NO_FILES = (*CIRCLES, "circle/out", "folder", "program.tmc/out", "nowhere/out", "x" * 300, "")


@pytest.mark.parametrize("line", TEXTS + FILES)
def test_an_output_that_cannot_be_a_file_is_refused_in_one_line(tool, line):
    suffix = next((ending for option, ending in SUFFIXES.items() if option in line), "")
    circle, link, folder = (Path(f"{name}{suffix}") for name in (*CIRCLES, "folder"))
    circle.symlink_to(circle)
    link.symlink_to(circle)
    folder.mkdir()
    for name in NO_FILES:
        if "--ready-file" in line and name in CIRCLES:
            continue  # a new file takes the place of the link
        out = name and f"{name}{suffix}"
        status, _, errors = tool([out if word == "OUT" else word for word in line.split()])
        assert (status, errors.count("\n")) == (2, 1), (out, errors)


def test_two_outputs_do_not_share_standard_output(tool):
    for line in (
        "run program.tmc --csv - --vcd -",
        "run program.tmc --csv - --json",
        "asm program.tmc -o - --listing -",
    ):
        status, output, errors = tool(line)
        assert (status, output, errors.count("\n")) == (2, b"", 1)
        assert " and " in errors


def test_a_summary_makes_room_for_the_table(tool):
    _, output, errors = tool("run program.tmc --csv -")
    assert output.startswith(b"time_ms,") and b"ended" not in output
    assert "1000" in errors


def test_a_reader_that_has_enough_of_the_table_ends_the_run_without_a_word(tmp_path):
    program = tmp_path / "program.tmc"
    program.write_text(PROGRAM)
    command = [Path(sys.executable).with_name("tmcm34x"), "run", program, "--csv", "-", "--sample", "0.01"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout.readline().startswith(b"time_ms,")
        running.stdout.close()
        errors = running.stderr.read()
    assert (running.returncode, errors) == (1, b"")
