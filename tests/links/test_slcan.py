"""An SLCAN adapter, as its host sees it."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.links import EXTENDED
from tmcm34x.links.posix.slcan import BIT_RATES, SlcanAdapter


class Bus:
    """A bus that remembers what is sent."""

    def __init__(self):
        self.frames = []
        self.clients = 0

    def connect(self, name, deliver):
        self.deliver = deliver
        self.clients += 1
        return self

    def receive_frame(self, identifier, data, bit_rate):
        self.frames.append((identifier, data, bit_rate))

    def disconnect(self):
        self.clients -= 1


class Host:
    """An adapter with its bus, asked line by line."""

    def __init__(self):
        self.bus = Bus()
        self.heard = bytearray()
        self.now_ms = 0
        self.adapter = SlcanAdapter(self.bus.connect, self.heard.extend, lambda: self.now_ms)

    def ask(self, text):
        self.adapter.receive(text.encode("latin-1"))
        answer = self.heard.decode("ascii")
        self.heard.clear()
        return answer


@pytest.fixture
def host():
    return Host()


def test_a_frame_goes_out_at_the_chosen_bit_rate(host):
    assert host.ask("S8\rO\r") == "\r\r"
    assert host.ask("t001706010000000000\r") == "z\r"
    assert host.bus.frames == [(1, bytes.fromhex("06010000000000"), 1_000_000)]


@pytest.mark.parametrize(("digit", "rate"), list(enumerate(BIT_RATES)))
def test_the_nine_bit_rates(host, digit, rate):
    host.ask(f"S{digit}\rO\rt1230\r")
    assert host.bus.frames == [(0x123, b"", rate)]


def test_a_frame_comes_in_as_text(host):
    host.ask("S8\rO\r")
    host.bus.deliver(2, bytes.fromhex("01640600000000"))
    assert host.ask("") == "t002701640600000000\r"


def test_a_frame_is_acknowledged_before_the_reply_to_it(host):
    """Lawicel's order: z is about sending, which is over before a module can answer."""

    def reply(identifier, data, bit_rate):
        host.bus.deliver(2, b"\x01")

    host.bus.receive_frame = reply
    assert host.ask("O\rt0010\r") == "\rz\rt002101\r"
    assert host.ask("T000000010\r") == "Z\rt002101\r"


def test_frames_may_carry_the_time(host):
    host.ask("Z1\rO\r")
    host.now_ms = 61_234
    host.bus.deliver(2, b"\xff")
    assert host.ask("") == "t0021FF04D2\r"


def test_a_closed_channel_neither_sends_nor_hears(host):
    assert host.ask("S8\rt0010\r") == "\r\a"
    host.bus.deliver(2, b"x")
    assert host.ask("O\rC\rt0010\r") == "\r\r\a"
    assert not host.bus.frames


def test_a_listener_hears_and_does_not_send(host):
    assert host.ask("L\rt0010\r") == "\r\a"
    host.bus.deliver(2, b"")
    assert host.ask("") == "t0020\r"


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("V", "V1011\r"),
        ("v", "v0343\r"),
        ("N", "N034X\r"),
        ("F", "\a"),
        ("", "\r"),
        ("M00000000", "\r"),
        ("s0014", "\r"),
    ],
)
def test_questions_about_the_adapter(host, line, answer):
    assert host.ask(line + "\r") == answer


def test_extended_frames_go_out_as_such(host):
    host.ask("S8\rO\r")
    assert host.ask("T00000001706040000000000\r") == "Z\r"
    assert host.bus.frames == [(EXTENDED | 1, bytes.fromhex("06040000000000"), 1_000_000)]
    host.bus.deliver(EXTENDED | 0x1FFFFFFF, b"\x01")
    assert host.ask("") == "T1FFFFFFF101\r"
    assert host.ask("T200000000\r") == "\a"


@pytest.mark.parametrize("line", ["r0010", "R000000010"])
def test_remote_frames_reach_nobody(host, line):
    assert host.ask(f"O\r{line}\r") in {"\rz\r", "\rZ\r"}
    assert not host.bus.frames


@pytest.mark.parametrize(
    "line", ["S9", "Sx", "S", "Oo", "t", "t001", "t0019", "t8000", "tzzz0", "t00120", "Z2", "?", "\xff"]
)
def test_nonsense_is_answered_with_a_bell(host, line):
    host.ask("O\r" if line[0] in "t" else "C\r")
    assert host.ask(f"{line}\r") == "\a"
    assert not host.bus.frames


def test_settings_are_refused_while_the_channel_is_open(host):
    assert host.ask("O\rS8\rZ1\rO\rF\r") == "\r\a\a\aF00\r"


def test_lines_may_come_in_pieces(host):
    assert host.ask("S") == ""
    assert host.ask("8\rO") == "\r"
    assert host.ask("\r") == "\r"


@settings(max_examples=300)
@given(st.lists(st.binary(max_size=100), max_size=6))
def test_rubbish_is_answered_line_by_line_and_never_raises(chunks):
    host = Host()
    for chunk in chunks:
        host.adapter.receive(chunk)
    lines = b"".join(chunks).count(b"\r")
    assert sum(host.heard.count(end) for end in (b"\r", b"\a")) == lines
    assert len(host.adapter._line) <= 65


def test_hanging_up_leaves_the_bus(host):
    host.ask("O\r")
    host.adapter.disconnect()
    assert host.bus.clients == 0
    host.bus.deliver(2, b"")
    assert host.ask("") == ""
