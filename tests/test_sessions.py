"""The session files: each case in memory on each of its models, and over every link with the same result."""

from pathlib import Path

import pytest

from session_links import LINKS
from session_marks import SlicedSerial, missing_marks, play
from tmcm34x import clock
from tmcm34x.bench import build, simple_rig
from tmcm34x.bench.description import parse
from tmcm34x.bench.session.language import KINDS, load
from tmcm34x.bench.session.language import parse as read
from tmcm34x.bench.session.runner import make_rig
from tmcm34x.bench.session.wires import MemorySerial, open_wire
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_reply, pack_request, unpack_reply

SESSIONS = Path(__file__).parent / "sessions"
PATHS = sorted(SESSIONS.glob("*.txt"))
CASES = [case for path in PATHS for case in load(path)]


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
    player = play(case, open_wire(KINDS[link], make_rig(case, model)), model, watched=True)
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
            expected = play(case, open_wire(KINDS[link], make_rig(case, model)), model)
            with wire_of(make_rig(case, model)) as wire:
                assert play(case, wire, model).replies == expected.replies


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_time_in_other_slices_gives_the_same_replies(path):
    for case in load(path):
        if "memory" in case.links:
            model = in_turn(case, 0)
            expected = play(case, MemorySerial(make_rig(case, model)), model)
            assert (
                play(case, SlicedSerial(make_rig(case, model), case.line), model).replies == expected.replies
            )


def played(text, model=343):
    (case,) = read("== a case\n" + text)
    return play(case, MemorySerial(simple_rig(model)), model, watched=True)


def test_a_pin_that_the_session_does_not_exercise_is_found_out():
    (case,) = read("== a case\n# pins: GAP AP.4..5 STATUS.3\n> GAP 4, 0\n< 100\n")
    marks = play(case, MemorySerial(simple_rig()), 343, watched=True).marks
    assert missing_marks(case, marks) == ["AP.5", "STATUS.3"]


def test_commands_that_a_program_passes_by_are_not_exercised():
    text = "> 132\n< 100\n> STOP\n< 101\n> ROR 0, 5\n< 101\n> 133\n< 100\n> 129 1\n< 100\n+ 1 ms\n"
    marks = played(text).marks
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
    port = SerialPort(simple_rig().modules[0], received.extend, any_address=True)
    port.receive(pack_request(address, Instruction(10, 66)))
    assert unpack_reply(received) == Reply(2, 1, 100, 10, 1)


@pytest.mark.pins("WIRE.bus WIRE.address")
def test_modules_on_one_line_answer_one_by_one():
    rig = build(
        parse("[[module]]\naddress = 1\n[[module]]\naddress = 2\nmodel = 341\n[[module]]\naddress = 5\n")
    )
    received = bytearray()
    ports = [SerialPort(module, received.extend) for module in rig.modules]
    for address in range(1, 7):
        for port in ports:
            port.receive(pack_request(address, Instruction(10, 66)))
        expected = pack_reply(Reply(2, address, 100, 10, address)) if address in {1, 2, 5} else b""
        assert received == expected
        received.clear()
