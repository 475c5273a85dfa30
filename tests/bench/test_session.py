"""The language of sessions, and a player in virtual time."""

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.bench.session.errors import SessionFailedError, SessionSyntaxError
from tmcm34x.bench.session.language import LONGEST, load, parse
from tmcm34x.bench.session.runner import make_rig, moving_line, play, playable
from tmcm34x.bench.session.wires import MemoryCan, MemorySerial
from tmcm34x.host.effects import moves
from tmcm34x.tmcl.mnemonic import parse_instruction


def played(text, model=343, wire=MemorySerial):
    (case,) = parse("== a case\n" + text)
    return play(case, wire(make_rig(case, model)), model)


@pytest.mark.parametrize(
    ("line", "column", "problem"),
    [
        ("GAP 1, 0", 1, "expected a line with == # | > <"),
        ("alwais: outputs 00000000", 1, "did you mean always?"),
        ("withn 5 s: outputs 00000000", 1, "did you mean within?"),
        ("> GAP", 3, "GAP needs 2 operands"),
        ("> FOO 1", 3, "unknown command FOO"),
        ("> MPV ABS, 0, 5", 3, "unknown command MPV; did you mean MVP?"),
        ("> MVP ABS, x, 5", 12, "not a number: x"),
        ("< fine", 3, "expected -, bytes, or a status"),
        ("+ 2 weeks", 3, "expected a time"),
        ("+ 2 mn", 3, "did you mean ms or min?"),
        ("+ soon", 3, "expected a time"),
        (f"+ {LONGEST} h", 3, "less than a thousand years"),
        ("! lightning", 3, "expected power, motor, input, analog, shutdown, spi, got lightning"),
        ("! motor 3 left switch closes", 9, "expected a number 0..2, got 3"),
        ("! motor 0 left swich closes", 16, "expected switch, cable, got swich; did you mean switch?"),
        ("! motor 0 fault open_load begins", 17, "did you mean open_load_"),
        ("! motor 0 moved to", 19, "expected a number"),
        ("! motor 0 moved to nan", 20, "expected a number, got nan"),
        ("! power off now", 13, "expected the end of the line, got now"),
        ("? weather", 3, "expected outputs, output, motor, program, variable, power, got weather"),
        ("? outputs 0000", 11, "expected eight bits"),
        ("? motor 0 load at 1..x", 19, "expected a number or a range a..b"),
        ("@ here", 3, "expected an address"),
        ("< 256", 3, "a status is 0..255, not 256"),
        ("< 100 10..5", 3, "a range goes from the lower number to the higher: 5..10"),
        ("< 100 1 of 500", 3, "the number of a command is 0..255"),
        ("? motor 0 at 10..5", 14, "expected an integer or a range a..b, got 10..5"),
        ("# models: 351", 11, "models are 341, 342 and 343"),
        ("# models:", 10, "models are 341, 342 and 343"),
        ("# links: usb", 10, "links are serial, can"),
        ("# links: serial seriel", 17, "did you mean serial?"),
        ("# bench: nowhere.toml", 10, "nowhere.toml: No such file"),
        ("within 5 sec: outputs 00000000", 8, "expected a time"),
        ("within 5 s: weather", 13, "expected outputs"),
        ("always: MVP ABS, 0, 5 is 100", 9, "expected a command that only reads"),
        ("never: GAP 1, 0 is moving", 20, "expected a status"),
        ("never: GPA 1, 0 is 100", 8, "did you mean GAP?"),
        ("never: GAP 1, 0", 8, "expected `is` and the reply after the command"),
        ("never: GAP 1, 0 is 100 3..2", 20, "a range goes from the lower number to the higher"),
    ],
)
def test_a_line_that_cannot_be_read_is_named_with_its_column(line, column, problem):
    with pytest.raises(SessionSyntaxError) as caught:
        parse(f"# a remark\n== a case\n> GAP 1, 0\n{line}\n")
    assert (caught.value.line, caught.value.column) == (4, column)
    assert problem in caught.value.problem
    assert str(caught.value).startswith(f"session:4:{column}: ")


def test_steps_belong_into_a_case():
    with pytest.raises(SessionSyntaxError, match="session:1: steps and pins belong under a line"):
        parse("> GAP 1, 0\n== a case\n")


def test_an_empty_session_has_no_case():
    with pytest.raises(SessionSyntaxError, match="belong under a line == title"):
        parse("")


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(SessionSyntaxError, match=r"gone\.session: No such file"):
        load(tmp_path / "gone.session")
    (tmp_path / "picture.session").write_bytes(b"\xff\xd8\xff\xe0")
    with pytest.raises(SessionSyntaxError, match="not a text file in UTF-8"):
        load(tmp_path / "picture.session")


@pytest.mark.parametrize(
    ("text", "line", "expected", "got"),
    [
        ("> GAP 4, 0\n< 100 999", 3, "status 100 of command 6 from 1 to 2, value 999", "value 1000"),
        ("> GAP 4, 0\n< 100 1..999", 3, "value 1..999", "value 1000"),
        ("> GAP 4, 0\n< 4", 3, "status 4", "status 100"),
        ("> GAP 4, 0\n< 100\n< 100", 4, "9 bytes", "nothing"),
        ("> GAP 4, 0\n< -", 3, "no reply", "02 01 64"),
        ("> GAP 4, 0\n> GAP 4, 0", 3, "every reply to be expected", "02 01 64"),
        ("> GAP 4, 0\n+ 1 s", 3, "every reply to be expected", "02 01 64"),
        ("> GAP 4, 0\nwithin 1 s: outputs 00000000", 3, "every reply to be expected", "02 01 64"),
        ("> GAP 4, 0", 2, "no reply", "02 01 64"),
        ("> GAP 4, 0\n< 100 1000 of 7", 3, "command 7", "command 6"),
        ("@ 1 host 3\n> GAP 4, 0\n< 100", 4, "from 1 to 3", "from 1 to 2"),
        ('> 01 06 04\n< 02 "x"', 3, "2 bytes", "nothing"),
        (
            "> 01 0a 42 00 00 00 00 00 4d\n< 02 01 64 0a 00 00 00 01 73",
            3,
            "02 01 64 0a 00 00 00 01 73",
            "72",
        ),
        ("> 01 06 04 00 00 00 00 00 00\n< 100", 3, "status 100", "status 1 "),
        ("> id 1: 06 04 00 00 00 00 00\n< 100", 2, "a CAN bus", "a serial line"),
        ("? outputs 00000001", 2, "outputs 00000001", "00000000"),
        ("? motor 0 current 255", 2, "motor 0 current 255", ""),
        ("? motor 0 load at 7 [343]", 2, "motor 0 load at 7", "at 0.000"),
        ("> ROR 0, 5\n< 100\n+ 1 s\n? motor 0 resting", 5, "motor 0 resting", "turning"),
    ],
)
def test_a_module_that_does_otherwise_is_found_out(text, line, expected, got):
    with pytest.raises(SessionFailedError) as caught:
        played(text)
    failure = caught.value
    assert failure.place.line == line
    assert expected in failure.unmet.expected
    assert got in failure.unmet.got


def test_bytes_have_no_place_on_a_can_bus():
    with pytest.raises(SessionFailedError, match="expected a serial line for bytes, got a CAN bus"):
        played("> 01 06 04", wire=MemoryCan)


def test_a_fault_that_a_model_cannot_have_is_a_failure():
    with pytest.raises(SessionFailedError, match="a TMCM-342 has no drivers to fail"):
        played("! motor 0 fault short_a begins", model=342)


def test_a_failure_tells_what_was_sent_expected_and_got():
    with pytest.raises(SessionFailedError) as caught:
        played("+ 2 ms\n> GAP 4, 0\n< 100 7")
    assert caught.value.report() == (
        "session:4: < 100 7\n"
        "    in        a case\n"
        "    at        0.002000 s\n"
        "    sent      > GAP 4, 0  [01 06 04 00 00 00 00 00 0b]\n"
        "    expected  status 100 of command 6 from 1 to 2, value 7\n"
        "    got       status 100 of command 6 from 1 to 2, value 1000  [02 01 64 06 00 00 03 e8 58]"
    )


def test_lines_for_other_models_are_passed_over():
    for model in (342, 343):
        played("> GAP 6, 0\n< 100 128 [341 343]\n< 3 [342]", model)


# Over time


MOVE = "> MVP ABS, 0, 10000\n< 100\n"


def test_within_goes_on_as_soon_as_the_condition_holds():
    player = played(MOVE + "within 5 s: GAP 8, 0 is 100 1\n> GAP 1, 0\n< 100 10000")
    assert 0.2 < player.now / 16e6 < 2


def test_within_measures_at_the_events_of_the_bench():
    player = played("> SIO 2, 2, 1\n< 100\nwithin 5 s: output 2 high")
    assert player.now == 0


def test_within_fails_when_the_time_is_over():
    with pytest.raises(SessionFailedError) as caught:
        played(MOVE + "within 100 ms: GAP 8, 0 is 100 1")
    assert caught.value.unmet.expected == "GAP 8, 0 is 100 1 within 0.1 s"
    assert caught.value.unmet.got == "100 0"
    assert caught.value.at_s == 0.1


def test_always_is_looked_at_after_each_line():
    with pytest.raises(SessionFailedError) as caught:
        played("always: outputs 00000000\n> SIO 2, 2, 1\n< 100")
    assert (caught.value.place.line, caught.value.unmet.got) == (2, "00000100")


def test_always_is_looked_at_while_time_passes():
    with pytest.raises(SessionFailedError) as caught:
        played("always: GAP 1, 0 is 100 0..5000\n" + MOVE + "+ 1 h")
    assert caught.value.place.line == 2
    assert caught.value.at_s < 1


def test_never_holds_where_nothing_happens():
    played("never: motor 0 lost steps\nnever: GAP 1, 1 is 100 5\n" + MOVE + "+ 5 s")


def test_never_finds_lost_steps():
    bench = '| [[module]]\n| [[module.axis]]\n| load = {kind = "carriage", high = 10}\n'
    with pytest.raises(SessionFailedError) as caught:
        played(bench + "never: motor 0 lost steps\n> ROR 0, 500\n< 100\n+ 10 s")
    assert caught.value.place.line == 5
    assert "full steps behind" in caught.value.unmet.got


def test_events_and_measurements_are_those_of_the_module_that_is_addressed():
    bench = "| [[module]]\n| address = 1\n| [[module]]\n| address = 5\n"
    played(
        bench + "@ 5\n> SIO 2, 2, 1\n< 100\n? output 2 high\n! input 3 high\n> GIO 3, 0\n< 100 1\n"
        "@ 1\n? output 2 low\n> GIO 3, 0\n< 100 0\nalways: GIO 2, 2 is 100 0"
    )


@pytest.mark.parametrize(
    "text",
    [
        "> ROR 0, 100\n< 100\n+ 1 s\n? motor 0 turning\n? motor 0 speed 99..100\n? motor 1 resting",
        "! motor 0 left switch closes\n? motor 0 left switch active\n! motor 0 left switch works\n"
        "? motor 0 left switch inactive",
        "! power off\n? power off\n! power on\n? power on",
        "> SGP 5, 2, 77\n< 100\n? variable 5 77\n? variable 5 70..80\n? program stopped",
        MOVE + "+ 5 s\n? motor 0 at 10000\n? motor 1 at -1..1",
        "! motor 1 moved to 20\n? motor 1 load at 20",
        "! spi 0 echo\n> SAC 0, 2, 4660\n< 100\n> SAC 0, 2, 0\n< 100 4660",
    ],
)
def test_what_happens_can_be_measured(text):
    played(text)


def test_a_bench_that_cannot_be_built_is_told_with_the_line_of_its_case():
    (case,) = parse("# a remark\n== a case\n| [[modul]]\n> GAP 1, 0\n")
    with pytest.raises(SessionSyntaxError, match=r"session:2: bench: .*modul"):
        make_rig(case, 343)


# On a real module


@pytest.mark.parametrize(
    "text",
    ["ROR 0, 5", "ROL 0, 5", "MVP REL, 0, 5", "RFS START, 0", "SAP 0, 1, 5", "SAP 2, 0, 1", "129 1", "130"],
)
def test_commands_that_may_move_a_motor(text):
    assert moves(parse_instruction(text))


@pytest.mark.parametrize("text", ["MST 0", "GAP 1, 0", "RFS STATUS, 0", "RFS STOP, 0", "SAP 4, 0, 5", "128"])
def test_commands_that_move_nothing(text):
    assert not moves(parse_instruction(text))


def test_the_first_line_that_may_move_is_named():
    (case,) = parse("== a case\n> GAP 1, 0\n< 100\n> 01 04 00 00 00 00 00 05 0a\n> ROR 0, 5")
    assert moving_line(case, 343).line == 4
    (case,) = parse('== text\n> "AMVP ABS 0 5\\r"')
    assert moving_line(case, 343).line == 2


def test_a_real_module_plays_what_needs_no_bench():
    (case,) = parse("== a case\n> GAP 1, 0\n? outputs 00000000\n< 100\n! power off\n> GAP 1, 0\n")
    assert [step.line for step in playable(case, 343)] == [2, 4]


def test_a_rig_is_fresh_for_each_case():
    first, second = (make_rig(parse("== a case\n")[0], 341) for _ in range(2))
    assert first is not second
    assert simple_rig(341).modules[0].board.model is first.modules[0].board.model
