"""`tmcm34x run --save-session` writes a session that `tmcm34x play` plays to the same moment."""

import re
from pathlib import Path

import pytest

from tmcm34x.bench.run import Run
from tmcm34x.bench.session.language import load
from tmcm34x.bench.session.runner import make_rig, play
from tmcm34x.bench.session.wires import open_wire
from tmcm34x.debug.conditions import Condition
from tmcm34x.testing.programs import assemble_source
from tmcm34x.testing.rigs import make_rig as bench_rig

ROOT = Path(__file__).parents[2]
BENCHES = ROOT / "examples" / "benches"
PROGRAM = """\
        SAP 4, 0, 800
        SGP 3, 2, -7
Loop:   MVP REL, 0, 3000
        WAIT POS, 0, 0
        CALC ADD, 1
        AGP 4, 2
        SIO 2, 2, 1
        JA Loop
"""


def reached(path):
    """The rig after a session was played."""
    (case,) = load(path)
    (model,) = case.models
    rig = make_rig(case, model)
    play(case, open_wire("serial", rig), model)
    return rig


def state(rig):
    """Programs but for how they were started, chips and worlds."""
    module = rig.modules[0]
    return (
        rig.now, module.program.registers.contents(), module.program.state, module.program.wait,
        tuple(chip.save() for chip in module.board.chips), rig.worlds[0].save(),
    )  # fmt: skip


@pytest.mark.parametrize("bench", [None, "xy-stage", "belt-stage", "conveyor"])
@pytest.mark.parametrize("condition", ["ap[1][0] passes 4321", "gp[4] == 3", "ap[3][0] > 700 && gp[4] > 0"])
def test_the_session_reaches_the_same_moment(invoke, bench, condition):
    Path("program.tmc").write_text(PROGRAM)
    options = [] if bench is None else ["--bench", BENCHES / f"{bench}.toml"]
    status, out, _ = invoke(
        "run", "program.tmc", *options, "--break", condition, "--save-session", "at.session"
    )
    assert status == 0 and re.search("break|condition", out)
    assert invoke("play", "at.session")[0] == 0
    rig = bench_rig(None, None if bench is None else BENCHES / f"{bench}.toml")
    rig.modules[0].eeprom.write_program(assemble_source(PROGRAM).program)
    look = Condition(condition).on(rig)
    run = Run(rig, None, look.holds, look.next_event)
    run.start()
    assert run.go() == "break"
    assert state(reached(Path("at.session"))) == state(rig)


def test_a_session_that_does_not_reach_it_fails(invoke):
    Path("program.tmc").write_text(PROGRAM)
    invoke("run", "program.tmc", "--break", "ap[1][0] passes 4321", "--save-session", "at.session")
    text = Path("at.session").read_text()
    assert "? motor 0 at 4321" in text
    clocks = int(re.search(r"\+ (\d+) clocks", text)[1])
    Path("at.session").write_text(text.replace(f"+ {clocks} clocks", f"+ {clocks - 1} clocks"))
    status, out, _ = invoke("play", "at.session")
    assert status == 1 and "4320" in out


def test_the_session_has_variables_times_and_parameters_of_the_run(invoke):
    Path("program.tmc").write_text("Loop: GGP 9, 2\nGAP 197, 0\nAGP 8, 2\nJA Loop\n")
    options = ["--set", "9=5", "--instruction-time", "250", "--seed", "3", "--parameters", "later"]
    invoke("run", "program.tmc", "--until", "0.01", *options, "--save-session", "at.session")
    text = Path("at.session").read_text()
    assert "> SGP 9, 2, 5" in text and "| instruction_us = 250.0" in text
    assert invoke("play", "at.session")[0] == 0


def test_what_a_session_cannot_hold_is_refused_before_the_run(invoke):
    Path("program.tmc").write_text(PROGRAM)
    bench = BENCHES / "xy-stage.toml"
    for options, word in (
        (["--from-state", "x.state"], "--from-state"),
        (["--bench", bench, "--instruction-time", "5"], "instruction_us"),
    ):
        status, _, message = invoke("run", "program.tmc", *options, "--save-session", "at.session")
        assert status == 2 and word in message and message.count("\n") == 0
    assert not Path("at.session").exists()
    status, _, message = invoke("run", "program.tmc", "--until", "1", "--save-session", "gone/at.session")
    assert status == 2 and "gone/at.session" in message
