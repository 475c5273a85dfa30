"""`tmcm34x run` on real files."""

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from vcdvcd import VCDVCD

from tmcm34x.cli import group
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.image import pack_binary, pack_hex

MOVE = "SAP 5, 0, 50 \n MVP ABS, 0, 5000 \n WAIT POS, 0, 0 \n MVP ABS, 0, 0 \n WAIT POS, 0, 0 \n STOP"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Call it with a program's text and options: exit status, standard output and error."""
    monkeypatch.chdir(tmp_path)

    def invoke(source, *options):
        path = source
        if not isinstance(source, Path):
            path = Path("program.tmc")
            path.write_text(source)
        result = CliRunner().invoke(
            group, ["run", str(path), *map(str, options)], standalone_mode=False, catch_exceptions=True
        )
        if result.exception is not None and not hasattr(result.exception, "exit_code"):
            raise result.exception
        status = getattr(result.exception, "exit_code", result.return_value or 0)
        message = result.exception.format_message() if result.exception is not None else ""
        return status, result.stdout, result.stderr + message

    return invoke


def summary(run, source, *options):
    status, out, _ = run(source, "--json", *options)
    return status, json.loads(out)


def test_a_run_ends_when_the_program_has_stopped_and_sums_up(run):
    status, out, err = run(MOVE)
    assert (status, err) == (0, "")
    assert out.splitlines()[0] == "ended       the program has stopped and every motor is at rest"
    assert "motor 0     distance 10000, peak speed" in out


def test_the_summary_as_json(run):
    status, data = summary(run, MOVE + "\n", "--model", 341)
    assert status == 0
    assert data["ending"] == "stopped"
    assert data["instructions"] == 6
    assert data["error"] is None
    first = data["motors"][0]
    assert (first["motor"], first["distance"], first["position"]) == (0, 10000, 0)
    assert 200 < first["peak_speed"] <= 1000
    assert 0.1 < data["simulated_s"] < 10


def test_the_way_counts_although_the_position_is_set(run):
    _, data = summary(
        run, "SAP 5, 0, 50 \n MVP ABS, 0, 3000 \n WAIT POS, 0, 0 \n SAP 0, 0, 0 \n SAP 1, 0, 0 \n STOP"
    )
    assert (data["motors"][0]["distance"], data["motors"][0]["position"]) == (3000, 0)


def test_the_program_stops_but_the_run_waits_for_the_motors(run):
    _, data = summary(run, "MVP ABS, 0, 5000 \n STOP")
    assert data["ending"] == "stopped"
    assert data["motors"][0]["position"] == 5000


def test_until_ends_an_endless_program(run):
    status, data = summary(run, "Loop: CALC ADD, 1 \n SIO 255, 2, -1 \n JA Loop", "--until", 2.5)
    assert (status, data["ending"], data["simulated_s"]) == (0, "until", 2.5)
    assert data["instructions"] == 25_000


@pytest.mark.parametrize(
    "source",
    [
        "Loop: GIO 0, 0 \n JC ZE, Loop \n STOP",
        "SGP 1, 2, 5 \n Loop: GGP 0, 2 \n COMP 1 \n JC NE, Loop \n STOP",
        "WAIT REFSW, 1, 0 \n STOP",
        "ROR 0, 100 \n STOP",
        "ROR 0, 100 \n Loop: JA Loop",
        "ROL 0, 100 \n WAIT TICKS, 0, 5 \n Loop: GAP 3, 0 \n COMP 0 \n JC NE, Loop \n STOP",
        "ROR 0, 2047 \n WAIT REFSW, 0, 0 \n STOP",
        "ROR 0, 100 \n WAIT LIMSW, 1, 0 \n STOP",
        "SAP 0, 1, 5 \n MST 1 \n ROR 0, 100 \n WAIT POS, 1, 0 \n STOP",
        "RFS START, 0 \n WAIT RFS, 0, 0 \n STOP",
        "RFS START, 0 \n STOP",
    ],
)
def test_a_run_ends_when_nothing_can_change_any_more(run, source):
    status, data = summary(run, source)
    assert (status, data["ending"]) == (0, "idle")
    assert data["simulated_s"] < 3


def test_a_motor_that_turns_to_the_awaited_position_gets_there(run):
    _, data = summary(
        run,
        "SAP 154, 0, 0 \n SAP 0, 0, 1 \n ROL 0, 2047 \n WAIT TICKS, 0, 10 \n WAIT POS, 0, 0 \n MST 0 \n STOP",
    )
    assert data["ending"] == "stopped"
    assert data["simulated_s"] == pytest.approx(2**24 / 499_755, rel=0.02)


@pytest.mark.parametrize(
    "wait", ["Poll: GAP 10, 0 \n JC ZE, Poll", "WAIT LIMSW, 0, 0", "RFS START, 0 \n WAIT RFS, 0, 0"]
)
def test_a_switch_behind_the_target_position_is_waited_for(run, wait):
    Path("bench.toml").write_text("""
[[module]]
[[module.axis]]
load = { kind = "carriage", lead_mm = 8.0, low = -10.0, high = 60.0, start = 1.0 }
switch = { left = { position = 0.0 }, right = { position = 40.0 } }
""")
    status, data = summary(
        run,
        f"MVP ABS, 0, 5000 \n WAIT TICKS, 0, 5 \n ROR 0, 300 \n {wait} \n SGP 1, 2, 7 \n STOP",
        "--bench", "bench.toml",
    )  # fmt: skip
    assert (status, data["ending"], data["variables"]) == (0, "stopped", {"1": 7})


def test_mistakes_are_diagnostics_with_status_1(run):
    status, out, err = run("MOVE 1\n")
    assert (status, out) == (1, "")
    assert "program.tmc:1:1: error" in err


@pytest.mark.parametrize(
    ("source", "text"),
    [
        ("CALC LOAD, 1", ""),
        ("SAP 4, 0, 9999 \n STOP", "program.tmc:1: SAP 4, 0, 9999: invalid value (status 4)"),
        ("STOP \n CALC LOAD, 1 \n", ""),
    ],
)
def test_program_errors_are_status_3(run, source, text):
    status, out, _ = run(source)
    assert status == (3 if text else 0)
    assert text in out


def test_a_program_without_stop_may_run_past_its_end(run):
    status, out, _ = run("CALC LOAD, 1", "--no-append-stop")
    assert status == 3
    assert "program.tmc: address 1: the program ran past its end" in out


def test_images_run_too(run):
    program = [Instruction(14, 3, 2, 1), Instruction(28)]
    Path("x.bin").write_bytes(pack_binary(program))
    Path("x.hex").write_text(pack_hex(program))
    for name in ("x.bin", "x.hex"):
        assert summary(run, Path(name))[1]["outputs"] == 8


def test_the_instruction_time_is_what_one_says(run):
    _, data = summary(run, "CALC LOAD, 1 \n" * 99 + "STOP", "--instruction-time", 250)
    assert data["simulated_s"] == pytest.approx(0.025)


def test_a_bench_hangs_on_the_module(run):
    Path("bench.toml").write_text("""
[[module]]
model = 342
[[module.axis]]
load = {kind = "carriage", start = 20.0}
switch = {left = {position = 10.0}}
""")
    source = "RFS START, 0 \n WAIT RFS, 0, 2000 \n JC ETO, End \n SIO 0, 2, 1 \n End: STOP"
    status, data = summary(run, source, "--bench", "bench.toml")
    assert (status, data["outputs"]) == (0, 1)
    status, _, err = run(source, "--bench", "bench.toml", "--model", 343)
    assert status == 2
    assert "TMCM-342" in err


def test_the_table_has_a_row_for_each_motor_and_sample(run):
    run("ROR 1, 500 \n WAIT TICKS, 0, 100 \n MST 1 \n STOP", "--csv", "out.csv", "--sample", 50, "--until", 1)
    text = Path("out.csv").read_text()
    assert text.startswith("time_ms,motor,position,speed,")
    rows = list(csv.DictReader(text.splitlines()))
    assert [row["time_ms"] for row in rows[::3]] == [str(50 * n) for n in range(21)]
    assert [row["motor"] for row in rows[:3]] == ["0", "1", "2"]
    positions = [int(row["position"]) for row in rows if row["motor"] == "1"]
    assert positions == sorted(positions)
    assert rows[-2]["speed"] == "500"


def test_waveforms_hold_every_step_and_the_program_counter(run):
    run(MOVE + "\n", "--vcd", "out.vcd")
    waves = VCDVCD("out.vcd")
    steps = [value for _, value in waves["module0.motor0.step"].tv]
    assert steps.count("1") == 10_000
    directions = [value for _, value in waves["module0.motor0.direction"].tv]
    assert directions == ["0", "1", "0"]
    counters = [int(value, 2) for _, value in waves["module0.counter"].tv]
    assert counters == [0, 1, 2, 3, 4, 5, 6]
    assert [value for _, value in waves["module0.running"].tv] == ["0", "1", "0"]


def test_pictures(run):
    assert run(MOVE, "--plot", "out.svg")[0] == 0
    svg = Path("out.svg").read_text()
    assert svg.startswith("<svg ")
    assert "MVP ABS, 0, 5000" in svg
    assert run(MOVE, "--plot", "out.png")[0] == 0
    assert Path("out.png").read_bytes().startswith(b"\x89PNG")
    status, _, err = run(MOVE, "--plot", "out.gif")
    assert status == 2
    assert ".svg or .png" in err


def test_the_trace_tells_each_command(run):
    _, _, err = run("CALC LOAD, 7 \n CALC ADD, 1 \n STOP", "--trace")
    lines = err.splitlines()
    assert len(lines) == 3
    assert lines[1].split() == ["0.000200", "1", "CALC", "ADD,", "1", "A", "7", "X", "0"]


def test_recording_changes_nothing(run):
    source = "MVP ABS, 0, 5000 \n Loop: GAP 8, 0 \n JC ZE, Loop \n GAP 1, 0 \n AGP 0, 2 \n STOP"
    plain = summary(run, source)[1]
    recorded = summary(run, source, "--vcd", "o.vcd", "--csv", "o.csv", "--plot", "o.svg", "--trace")[1]
    for key in ("simulated_s", "instructions", "motors", "variables"):
        assert plain[key] == recorded[key]


def test_a_paced_run_takes_its_time(run):
    _, data = summary(run, "WAIT TICKS, 0, 40 \n STOP", "--speed", 4)
    assert data["wall_s"] >= 0.09


@pytest.mark.parametrize("option", ["--csv", "--vcd", "--plot"])
def test_a_file_that_cannot_be_written_is_one_line(run, option):
    status, _, err = run(MOVE, option, "missing/out.svg")
    assert status == 2
    assert err == "missing/out.svg: No such file or directory"


def test_a_missing_program_is_one_line(run):
    status, _, err = run(Path("missing.tmc"))
    assert (status, err) == (2, "missing.tmc: No such file or directory")


def test_expectations_of_the_bench_file_are_checked(run):
    program = "MVP ABS, 0, 10000\nWAIT POS, 0, 0\nSIO 0, 2, 1\nSTOP\n"
    text = '[[module]]\n[[event]]\nat_ms = 0\ndo = "expect"\nexpect = "{}"\n'
    bench = Path("bench.toml")
    bench.write_text(text.format("within 3 s: output 0 high"))
    assert run(program, "--bench", bench)[0] == 0
    bench.write_text(text.format("always: outputs 00000000"))
    status, _, err = run(program, "--bench", bench)
    assert status == 4
    assert "tmcm34x run: bench.toml: 'always: outputs 00000000' of event[0] failed at 0." in err
