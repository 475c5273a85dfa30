"""The session files: each case in memory on each of its models, and over every link with the same result."""

from pathlib import Path

import msgspec
import pytest

from session_links import LINKS
from session_runner import (
    KIND,
    MemoryCan,
    MemorySerial,
    SessionError,
    SlicedSerial,
    all_cases,
    load,
    missing_marks,
    play,
)
from tmcm34x import clock
from tmcm34x.bench import build, simple_rig
from tmcm34x.bench.description import parse
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_reply, pack_request, unpack_reply

SESSIONS = Path(__file__).parent / "sessions"
CASES = list(all_cases(SESSIONS))
PATHS = sorted(SESSIONS.glob("*.txt"))
MEMORY = {"serial": MemorySerial, "can": MemoryCan}


def rig(case, model):
    """What the case asks for: a bare module, or the bench in its file with another model."""
    if not case.bench:
        return simple_rig(model)
    bench = parse(case.bench)
    return build(
        msgspec.structs.replace(bench, module=[msgspec.structs.replace(bench.module[0], model=model)])
    )


@pytest.mark.parametrize(
    ("case", "link", "model"),
    [
        pytest.param(case, link, model, id=f"{case}-{link}-{model}")
        for case in CASES
        for link in ("memory", "can")
        if link in case.links
        for model in sorted(case.models)
    ],
)
def test_a_module_does_as_the_session_says_and_as_it_pins(case, link, model):
    player = play(case, MEMORY[KIND[link]](rig(case, model)), model, watched=True)
    assert not missing_marks(case, player.marks)


def in_turn(case, number):
    """One of the case's models, another one for each case and number."""
    models = sorted(case.models)
    return models[(case.line + number) % len(models)]


@pytest.mark.parametrize("number", range(len(LINKS)), ids=list(LINKS))
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_a_link_gives_the_same_replies_as_memory(path, number):
    link, wire_of = list(LINKS.items())[number]
    for case in load(path):
        if link in case.links:
            model = in_turn(case, number)
            expected = play(case, MEMORY[KIND[link]](rig(case, model)), model)
            with wire_of(rig(case, model)) as wire:
                assert play(case, wire, model).replies == expected.replies


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_time_in_other_slices_gives_the_same_replies(path):
    for case in load(path):
        if "memory" in case.links:
            model = in_turn(case, 0)
            expected = play(case, MemorySerial(rig(case, model)), model)
            assert play(case, SlicedSerial(rig(case, model), case.line), model).replies == expected.replies


def session(tmp_path, text):
    path = tmp_path / "session.txt"
    path.write_text(text)
    return path


def played(tmp_path, text, model=343):
    (case,) = load(session(tmp_path, "== a case\n" + text))
    return play(case, MemorySerial(simple_rig(model)), model, watched=True)


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("GAP 1, 0", "a line starts with one of"),
        ("> GAP", "GAP needs 2 operands"),
        ("> FOO 1", "unknown command FOO"),
        ("< fine", "expected -, bytes, or a status"),
        ("+ 2 weeks", "expected a time"),
        ("+ soon", "expected a time"),
        ("! lightning", "unknown event"),
        ("? weather", "unknown measurement"),
        ("@ here", "expected an address"),
        ("# models: 351", "models are 341, 342 and 343"),
        ("# links: usb", "links are serial, can"),
    ],
)
def test_a_line_that_cannot_be_read_is_named(tmp_path, line, problem):
    with pytest.raises(SessionError, match=problem) as caught:
        load(session(tmp_path, f"# a remark\n== a case\n> GAP 1, 0\n{line}\n"))
    assert "session.txt:4: " in str(caught.value)


def test_steps_belong_into_a_case(tmp_path):
    with pytest.raises(SessionError, match="belong under a line"):
        load(session(tmp_path, "> GAP 1, 0\n== a case\n"))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("> GAP 4, 0\n< 100 999", r"session.txt:3: < 100 999: got Reply\(host=2.*value=1000\)"),
        ("> GAP 4, 0\n< 100 1..999", "session.txt:3: .*value=1000"),
        ("> GAP 4, 0\n< 4", "session.txt:3: .*status=100"),
        ("> GAP 4, 0\n< 100\n< 100", "session.txt:4: < 100: got nothing"),
        ("> GAP 4, 0\n< -", "session.txt:3: .*expected no reply, got 02 01 64"),
        ("> GAP 4, 0\n> GAP 4, 0", "session.txt:3: .*not read yet: 02 01 64"),
        ("> GAP 4, 0\n+ 1 s", "session.txt:3: .*not read yet: 02 01 64"),
        ("> GAP 4, 0", "end of a case: expected no reply"),
        ("> GAP 4, 0\n< 100 1000 of 7", "session.txt:3: .*command=6"),
        ("@ 1 host 3\n> GAP 4, 0\n< 100", "session.txt:4: .*host=2"),
        ('> 01 06 04\n< 02 "x"', "session.txt:3: .*got nothing"),
        ("> 01 0a 42 00 00 00 00 00 4d\n< 02 01 64 0a 00 00 00 01 73", "session.txt:3: .*got 02 01 64"),
        ("? outputs 00000001", "session.txt:2: .*it is 00000000"),
        ("? motor 0 current 255", "session.txt:2: .*it is "),
        ("? motor 0 load at 7", "session.txt:2: .*it is at 0.000"),
    ],
)
def test_a_module_that_does_otherwise_is_found_out(tmp_path, text, problem):
    with pytest.raises(SessionError, match=problem):
        played(tmp_path, text)


def test_lines_for_other_models_are_passed_over(tmp_path):
    played(tmp_path, "> GAP 6, 0\n< 100 128 [341 343]\n< 3 [342]", model=343)
    played(tmp_path, "> GAP 6, 0\n< 100 128 [341 343]\n< 3 [342]", model=342)


def test_a_pin_that_the_session_does_not_exercise_is_found_out(tmp_path):
    (case,) = load(session(tmp_path, "== a case\n# pins: GAP AP.4..5 STATUS.3\n> GAP 4, 0\n< 100\n"))
    marks = play(case, MemorySerial(simple_rig()), 343, watched=True).marks
    assert missing_marks(case, marks) == ["AP.5", "STATUS.3"]


def test_commands_that_a_program_passes_by_are_not_exercised(tmp_path):
    text = "> 132\n< 100\n> STOP\n< 101\n> ROR 0, 5\n< 101\n> 133\n< 100\n> 129 1\n< 100\n+ 1 ms\n"
    marks = played(tmp_path, text).marks
    assert "STOP" in marks
    assert "ROR" not in marks


@pytest.mark.pins("UF.customer UF0 UF1 UF2 UF3 UF4 UF5 UF6 UF7")
def test_user_functions_answer_what_the_customers_firmware_says():
    rig = simple_rig()
    module, wire = rig.modules[0], MemorySerial(rig)
    for n in range(8):
        module.user_functions[n] = lambda module, type_, motor, value, n=n: (100 + n, type_ + motor + value)
        wire.send(pack_request(1, Instruction(64 + n, n, 10, 1000)))
        assert unpack_reply(wire.received) == Reply(2, 1, 100 + n, 64 + n, 1010 + n)
        wire.received.clear()


@pytest.mark.pins("UF.customer PROG.accumulator")
def test_a_programs_user_function_loads_the_accumulator():
    rig = simple_rig()
    module = rig.modules[0]
    module.user_functions[3] = lambda module, type_, motor, value: (100, value * 2)
    module.eeprom.write_program([Instruction(67, 0, 0, 21), Instruction(28)])
    module.program.run(0)
    MemorySerial(rig).advance(clock.MS)
    assert module.program.accumulator == 42


@pytest.mark.pins("WIRE.any-address")
@pytest.mark.parametrize("address", [0, 1, 77, 255])
def test_usb_takes_any_address(address):
    received = bytearray()
    port = simple_rig().modules[0].open_serial_port(received.extend, any_address=True)
    port.receive(pack_request(address, Instruction(10, 66)))
    assert unpack_reply(received) == Reply(2, 1, 100, 10, 1)


@pytest.mark.pins("WIRE.bus WIRE.address")
def test_modules_on_one_line_answer_one_by_one():
    rig = build(
        parse("[[module]]\naddress = 1\n[[module]]\naddress = 2\nmodel = 341\n[[module]]\naddress = 5\n")
    )
    received = bytearray()
    ports = [module.open_serial_port(received.extend) for module in rig.modules]
    for address in range(1, 7):
        for port in ports:
            port.receive(pack_request(address, Instruction(10, 66)))
        expected = pack_reply(Reply(2, address, 100, 10, address)) if address in {1, 2, 5} else b""
        assert received == expected
        received.clear()
