"""`tmcm34x run` on real files."""

import csv
import json
from pathlib import Path

import pytest

from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.image import pack_binary, pack_hex
from waveforms import VCDVCD

MOVE = "SAP 5, 0, 50 \n MVP ABS, 0, 5000 \n WAIT POS, 0, 0 \n MVP ABS, 0, 0 \n WAIT POS, 0, 0 \n STOP"


@pytest.fixture
def run(invoke):
    """Call it with a program's text and options: exit status, standard output and error."""

    def call(source, *options):
        path = source
        if not isinstance(source, Path):
            path = Path("program.tmc")
            path.write_text(source)
        return invoke("run", path, *options)

    return call


def summary(run, source, *options):
    status, out, _ = run(source, "--json", *options)
    return status, json.loads(out)


def test_a_parameter_whose_hardware_is_absent_is_named(run):
    source = "GAP 209, 0 \n AGP 0, 2 \n GAP 209, 1 \n AGP 1, 2 \n SAP 212, 0, 5 \n STOP"
    _, out, _ = run(source)
    assert [line for line in out.split("\n") if line.startswith("absent")] == [
        "absent      program.tmc:1: GAP 209, 0: the encoder position needs an encoder on a TMCM-323, "
        "which the bench does not have",
        "absent      program.tmc:5: SAP 212, 0, 5: the maximum encoder deviation needs an encoder on a TMCM-323, "
        "which the bench does not have",
    ]
    bench = Path("bench.toml")
    bench.write_text("[[module]]\nspi.SPI_SEL0 = { kind = 'tmcm323' }\n")
    _, data = summary(run, source, "--bench", bench)
    assert len(data["absent"]) == 2
    _, data = summary(run, f"SGP 74, 0, 1 \n {source}", "--bench", bench)
    assert data["absent"] == []


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
    ("source", "ending"),
    [
        ("Loop: GIO 0, 0 \n JC ZE, Loop \n STOP", "idle"),
        ("SGP 1, 2, 5 \n Loop: GGP 0, 2 \n COMP 1 \n JC NE, Loop \n STOP", "idle"),
        ("WAIT REFSW, 1, 0 \n STOP", "idle"),
        ("ROR 0, 100 \n STOP", "turning"),
        ("ROR 0, 100 \n Loop: JA Loop", "turning"),
        ("ROL 0, 100 \n WAIT TICKS, 0, 5 \n Loop: GAP 3, 0 \n COMP 0 \n JC NE, Loop \n STOP", "turning"),
        ("ROR 0, 2047 \n WAIT REFSW, 0, 0 \n STOP", "turning"),
        ("ROR 0, 100 \n WAIT LIMSW, 1, 0 \n STOP", "turning"),
        ("SAP 0, 1, 5 \n MST 1 \n ROR 0, 100 \n WAIT POS, 1, 0 \n STOP", "turning"),
        ("RFS START, 0 \n WAIT RFS, 0, 0 \n STOP", "turning"),
        ("RFS START, 0 \n STOP", "turning"),
    ],
)
def test_a_run_ends_when_nothing_can_change_any_more(run, source, ending):
    status, data = summary(run, source)
    assert (status, data["ending"]) == (0, ending)
    assert data["simulated_s"] < 3
    assert [motor["motor"] for motor in data["turning"]] == ([0] if ending == "turning" else [])


def test_a_turning_motor_keeps_the_run_going_until_its_limit(run):
    status, data = summary(run, "ROR 0, 100 \n STOP", "--until", 3600)
    assert (status, data["ending"], data["simulated_s"]) == (0, "until", 3600)
    assert "motor 0 keeps turning" in run("ROR 0, 100 \n STOP")[1].splitlines()[0]


def test_a_program_that_only_computes_is_run_to_its_limit(run):
    source = "L: GGP 0, 2 \n CALC ADD, 1 \n AGP 0, 2 \n JA L"
    plain, traced = (summary(run, source, "--until", 1, *option)[1] for option in ([], ["--trace"]))
    assert plain["variables"] == traced["variables"] == {"0": 2500}
    assert plain["ending"] == traced["ending"] == "until"


def test_a_computation_that_ends_is_run_to_its_end(run):
    source = "L: CALC ADD, 1 \n COMP 300000 \n JC LT, L \n AGP 1, 2 \n E: JA E"
    _, data = summary(run, source)
    assert (data["ending"], data["variables"]) == ("idle", {"1": 300_000})


def test_where_the_program_is_at_the_end_and_what_it_waits_for(run):
    _, out, _ = run("MVP ABS, 0, 500 \n WAIT REFSW, 1, 0 \n STOP")
    assert "program     waits at program.tmc:2: WAIT REFSW, 1, 0, for the left switch of motor 1" in out
    _, out, _ = run("CALC LOAD, 3 \n Loop: GIO 0, 0 \n JC ZE, Loop \n STOP")
    assert "program     goes round at program.tmc:2 to program.tmc:3, asking for GIO 0, 0" in out
    _, out, _ = run("MVP ABS, 0, 500000 \n WAIT POS, 0, 0 \n STOP", "--until", 0.1)
    assert "for motor 0 to reach its target: it is at" in out
    assert "STOP" not in run("STOP")[1]


def test_every_refused_command_is_listed_with_its_count(run):
    source = "Loop: SAP 4, 0, 9999 \n SIO 9, 2, 1 \n CALC ADD, 1 \n COMP 3 \n JC LT, Loop \n STOP"
    status, out, _ = run(source)
    assert status == 3
    errors = [line for line in out.splitlines() if line.startswith("error")]
    assert errors[0] == "error       program.tmc:1: SAP 4, 0, 9999: invalid value (status 4), 3 times"
    assert errors[1].startswith("error       program.tmc:2: SIO 9, 2, 1: ")
    assert [refusal["count"] for refusal in summary(run, source)[1]["refusals"]] == [3, 3]


def test_outputs_that_blink_are_told(run):
    _, out, _ = run("SIO 3, 2, 1 \n SIO 3, 2, 0 \n SIO 3, 2, 1 \n SIO 3, 2, 0 \n STOP")
    assert "outputs     00000000; OUT_3 switched 4 times" in out


def test_lost_steps_are_told(run):
    Path("bench.toml").write_text(
        '[[module]]\n[[module.axis]]\nload = {kind = "carriage", high = 2.0, start = 1.0}\n'
    )
    _, out, _ = run("MVP ABS, 0, 50000 \n WAIT POS, 0, 0 \n STOP", "--bench", "bench.toml")
    assert "full steps lost" in out


def test_user_variables_are_set_before_the_start(run):
    source = "GGP 10, 2 \n CALC ADD, 1 \n AGP 11, 2 \n STOP"
    assert summary(run, source, "--set", "10=$1".replace("$", "0x"), "--set", "3=-7")[1]["variables"] == {
        "3": -7, "10": 1, "11": 2,
    }  # fmt: skip


@pytest.mark.parametrize("text", ["10", "x=1", "56=1", "1=4294967296"])
def test_a_wrong_assignment_is_one_line(run, text):
    status, out, err = run("STOP", "--set", text)
    assert (status, out) == (2, "")
    assert text in err
    assert len(err.splitlines()) == 1


def test_a_fall_through_in_an_include_is_told_with_its_file(run):
    Path("part.tmc").write_text("CALC LOAD, 1 \n CALC ADD, 1\n")
    _, out, _ = run("CALC LOAD, 3 \n #include part.tmc\n", "--no-append-stop")
    assert "error       part.tmc:2: the program ran past its end" in out


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
    assert "program.tmc:1: the program ran past its end" in out


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


def test_the_last_row_of_the_table_is_of_the_end(run):
    _, data = summary(run, MOVE, "--csv", "out.csv", "--sample", 50)
    rows = list(csv.DictReader(Path("out.csv").read_text().splitlines()))
    assert float(rows[-1]["time_ms"]) == pytest.approx(data["simulated_s"] * 1000, abs=1e-6)
    assert len(rows) == len({(row["time_ms"], row["motor"]) for row in rows})


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
    (failure,) = json.loads(run(program, "--bench", bench, "--json")[1])["failures"]
    assert failure.startswith("'always: outputs 00000000' of event[0] failed at 0.")


def test_coverage_adds_up_over_runs(run):
    source = "GIO 0, 0 \n JC ZE, End \n SIO 0, 2, 1 \n End: STOP\n"
    for count in (1, 2):
        assert run(source, "--coverage", "out.info")[0] == 0
        assert f"DA:2,{count}\n" in Path("out.info").read_text()
    assert "always jumped" in Path("out.html").read_text()
    Path("out.info").write_text("something else\n")
    status, _, err = run(source, "--coverage", "out.info")
    assert status == 2
    assert "not of an lcov tracefile" in err
    assert Path("out.info").read_text() == "something else\n"


def test_a_tracefile_keeps_other_programs_and_models(run):
    other = Path("other.tmc")
    other.write_text("STOP\n")
    by_model = "#if MODEL == 342\nSIO 0, 2, 1\n#else\nSIO 1, 2, 1\n#endif\nSTOP\n"
    run(other, "--coverage", "out.info")
    run(by_model, "--coverage", "out.info", "--model", "342")
    run(by_model, "--coverage", "out.info", "--model", "343")
    counted = [line for line in Path("out.info").read_text().split("\n") if line[:2] in ("SF", "DA")]
    assert counted == ["SF:other.tmc", "DA:1,1", "SF:program.tmc", "DA:2,1", "DA:4,1", "DA:6,2"]
    assert "STOP" in Path("out.html").read_text()
    run("STOP\n", "--coverage", "out.info")
    assert "SF:program.tmc\nBRF:0\nBRH:0\nDA:1,1\nLF:1\n" in Path("out.info").read_text()


def test_coverage_needs_a_source(run):
    Path("x.bin").write_bytes(pack_binary([Instruction(28)]))
    status, _, err = run(Path("x.bin"), "--profile")
    assert status == 2
    assert "need the source" in err


def test_the_profile_is_printed(run):
    _, out, _ = run("WAIT TICKS, 0, 100 \n STOP", "--profile")
    assert "   1.0001   99.99          1  program.tmc:1" in out


def test_a_run_ends_at_a_condition(run):
    source = "L: CALC ADD, 1 \n AGP 0, 2 \n JA L"
    _, data = summary(run, source, "--break", "accumulator == 40")
    assert (data["ending"], data["variables"]) == ("break", {"0": 39})
    status, _, err = run(source, "--break", "accumulator ==")
    assert status == 2
    assert len(err.splitlines()) == 1


LONG = "MVP ABS, 0, 20000 \n WAIT POS, 0, 0 \n L: CALC ADD, 1 \n AGP 0, 2 \n COMP 500 \n JC LT, L \n STOP"


@pytest.mark.parametrize("end", [("--until", 0.05), ("--break", "accumulator == 77")])
def test_a_run_goes_on_from_a_saved_state_as_if_it_had_not_ended(run, end):
    whole = summary(run, LONG)[1]
    assert summary(run, LONG, *end, "--save-state", "rig.state")[1]["ending"] in {"until", "break"}
    rest = summary(run, LONG, "--from-state", "rig.state")[1]
    for key in ("ending", "simulated_s", "instructions", "variables", "program"):
        assert rest[key] == whole[key]


def test_a_state_that_does_not_fit_is_one_line(run):
    Path("other.state").write_bytes(b"rubbish")
    status, _, err = run(LONG, "--from-state", "other.state")
    assert (status, err) == (2, "other.state: not a snapshot of a bench")
    run(LONG, "--until", 0.05, "--save-state", "rig.state")
    status, _, err = run("STOP", "--from-state", "rig.state")
    assert status == 2
    assert "another program" in err
    status, _, err = run(LONG, "--model", 341, "--from-state", "rig.state")
    assert status == 2
    assert len(err.splitlines()) == 1
    assert run(LONG, "--from-state", "missing.state")[2] == "missing.state: No such file or directory"


@pytest.mark.parametrize(
    ("options", "position"), [((), 100), (("--model", 342), 200), (("--bench", "b.toml"), 300)]
)
def test_conditions_ask_for_the_model_that_runs(run, tmp_path, options, position):
    (tmp_path / "b.toml").write_text("[[module]]\nmodel = 341\n")
    text = (
        "Goal = 100\n#if MODEL == 342\nGo: MVP ABS, 0, 200\n#else\n#if MODEL == 341\nMVP ABS, 0, 300\n"
        "#else\nMVP ABS, 0, Goal\n#endif\n#endif\nWAIT POS, 0, 0\nSTOP\n"
    )
    status, result = summary(run, text, *options)
    assert status == 0
    assert result["motors"][0]["position"] == position
