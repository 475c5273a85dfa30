"""A bare serial port: the bytes themselves."""

from pathlib import Path

import pytest
import serial

from conftest import PATIENCE_S
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_reply, pack_request, unpack_reply

GAP_1 = pack_request(1, Instruction(6, 1, 0))


@pytest.fixture(scope="module")
def path(serve_once):
    """The pseudo terminal of one module."""
    return serve_once("--pty").pty


@pytest.fixture
def port(path):
    """A pyserial port on it."""
    with serial.Serial(path, 9600, timeout=PATIENCE_S) as port:
        yield port


def ask(port, instruction, address=1):
    port.write(pack_request(address, instruction))
    return unpack_reply(port.read(9))


def test_the_manuals_first_example(port):
    """Manual 6.7.1: ROR 0, 350 and its reply."""
    port.write(bytes.fromhex("01 01 00 00 00 00 01 5e 61"))
    assert port.read(9) == bytes.fromhex("02 01 64 01 00 00 01 5e c7")


def test_the_version_string_has_no_tenth_byte(port):
    port.write(pack_request(1, Instruction(136)))
    assert port.read(9) == b"\x02343V4.36"
    port.timeout = 0.05
    assert port.read(1) == b""


def test_a_wrong_checksum_is_answered_and_a_foreign_address_is_not(port):
    port.write(GAP_1[:-1] + b"\x00")
    assert unpack_reply(port.read(9)).status == 1
    port.timeout = 0.05
    port.write(pack_request(9, Instruction(6, 1, 0)))
    assert port.read(1) == b""


def test_glued_telegrams_are_answered_one_by_one(port):
    port.write(pack_request(1, Instruction(6, 4, 0)) * 50)
    assert port.read(9 * 50) == pack_reply(Reply(2, 1, 100, 6, 1000)) * 50


def test_event_138_answers_twice(serve):
    with serial.Serial(serve("--pty", "--speed", 10).pty, timeout=PATIENCE_S) as port:
        ask(port, Instruction(4, 0, 0, 8000))
        assert ask(port, Instruction(138, 0, 0, 1)).status == 100
        reached = unpack_reply(port.read(9))
        assert (reached.status, reached.value) == (128, 1)
        assert ask(port, Instruction(6, 1, 0)).value == pytest.approx(8000, abs=1)


def test_clients_may_come_and_go(path):
    for number in range(3):
        with serial.Serial(path, timeout=PATIENCE_S, exclusive=True) as port:
            assert ask(port, Instruction(10, 9, 2)).value == number
            ask(port, Instruction(9, 9, 2, number + 1))


def test_a_client_that_leaves_within_a_telegram_does_no_harm(path, wait_for):
    with serial.Serial(path) as port:
        port.write(GAP_1[:5])
    with serial.Serial(path, timeout=1.0) as port:

        def answered():
            port.write(GAP_1)
            return len(port.read(9)) == 9

        assert wait_for(answered)


def test_at_another_bit_rate_a_strict_module_is_silent(serve):
    """Manual 8.1, parameter 65: 9600 baud until it is changed; 7 is 115200."""
    with serial.Serial(serve("--pty", "--strict-baud").pty, 115200, timeout=0.1) as port:
        port.write(GAP_1)
        assert port.read(9) == b""
        port.baudrate = 9600
        port.timeout = PATIENCE_S
        assert ask(port, Instruction(9, 65, 0, 7)).status == 100
        port.baudrate = 115200
        assert ask(port, Instruction(10, 65, 0)).value == 7


def test_with_any_address_all_telegrams_are_heard(serve):
    with serial.Serial(serve("--pty", "--any-address").pty, timeout=PATIENCE_S) as port:
        assert ask(port, Instruction(10, 66, 0), address=77).status == 100


def test_three_modules_share_one_line(serve):
    """The bench file's three kinds of module, at addresses 1 to 3."""
    bench = Path(__file__).parents[2] / "examples" / "benches" / "rs485.toml"
    with serial.Serial(serve("--pty", "--bench", bench).pty, timeout=PATIENCE_S) as port:
        versions = []
        for address in (3, 1, 2):
            port.write(pack_request(address, Instruction(136)))
            versions.append(port.read(9)[1:].decode())
        assert versions == ["343V4.36", "341V4.36", "342V4.36"]
        ask(port, Instruction(9, 5, 2, 50), address=2)
        assert [ask(port, Instruction(10, 5, 2), address=n).value for n in (1, 2, 3)] == [0, 50, 0]
