"""Finding the reply: what lines do to telegrams."""

import socket

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.host import (
    Connection,
    GarbledReplyError,
    HostError,
    LinkError,
    NoReplyError,
    RefusedError,
    open_stream,
)
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_reply, pack_request, unpack_request


class Line:
    """A stream that answers each telegram with the next of `answers`: chunks, each from one read."""

    def __init__(self, *answers, waiting=b""):
        self.answers = list(answers)
        self.sent = []
        self.pending = [waiting] if waiting else []

    def write(self, data):
        self.sent.append(unpack_request(data))
        if self.answers:
            answer = self.answers.pop(0)
            self.pending += answer if isinstance(answer, list) else [answer]

    def read(self, timeout_s):
        return self.pending.pop(0) if self.pending else b""

    def close(self):
        self.pending = []


def reply(value=0, command=6, status=100, address=1):
    return pack_reply(Reply(2, address, status, command, value))


GAP = Instruction(6, 1, 0)
EVENT = pack_reply(Reply(2, 1, 128, 138, 1))


def test_the_value_of_the_reply_comes_back():
    line = Line(reply(-5))
    assert Connection(line, address=1).command(6, 1) == -5
    assert line.sent == [(1, GAP)]


def test_another_address_for_one_command():
    line = Line(reply(7, address=9))
    assert Connection(line).execute(GAP, address=9).value == 7


def test_a_reply_may_come_in_pieces():
    data = reply(1234)
    assert Connection(Line([data[:1], data[1:5], data[5:]])).command(6, 1) == 1234


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=30), st.integers(-(2**31), 2**31 - 1))
def test_stray_bytes_before_a_reply_are_skipped(noise, value):
    connection = Connection(Line([noise, reply(value)] if noise else reply(value)))
    assert connection.execute(GAP).command == 6


def test_what_is_left_of_an_earlier_reply_is_no_answer():
    line = Line(reply(5), waiting=reply(4))
    assert Connection(line).command(6, 1) == 5


@pytest.mark.parametrize("late", [reply(1, command=5), reply(1, address=2), reply(1)[:-1] + b"\x00"])
def test_replies_to_others_are_skipped(late):
    assert Connection(Line([late, reply(2)])).command(6, 1) == 2


def test_an_error_status_raises():
    with pytest.raises(RefusedError, match="GAP 1, 0: status 3, wrong type") as caught:
        Connection(Line(reply(0, status=3))).execute(GAP)
    assert (caught.value.status, caught.value.instruction) == (3, GAP)


def test_a_command_that_was_damaged_on_the_way_is_sent_again():
    move = Instruction(4, 1, 0, 100)
    line = Line(reply(0, command=4, status=1), reply(100, command=4))
    assert Connection(line).execute(move).value == 100
    assert len(line.sent) == 2


def test_reading_is_tried_again_after_silence():
    line = Line(b"", b"\xff\xff", reply(3))
    assert Connection(line).command(6, 1) == 3


def test_a_motion_is_not_tried_again_after_silence():
    line = Line(b"", reply(3, command=4))
    with pytest.raises(NoReplyError, match="MVP REL, 0, 100: no reply within 1 s"):
        Connection(line).command(4, 1, 0, 100)
    assert len(line.sent) == 1


def test_bytes_that_are_no_reply_are_shown():
    with pytest.raises(GarbledReplyError, match="GAP 1, 0: no reply in 41 42"):
        Connection(Line(b"AB"), retries=0).execute(GAP)


def test_events_are_kept_wherever_they_come():
    connection = Connection(Line([EVENT + reply(1)], waiting=EVENT))
    assert connection.command(6, 1) == 1
    assert [event.value for event in connection.events] == [1, 1]


def test_the_version_string_has_its_own_form():
    assert Connection(Line([b"\x00\x02343V4.36"])).version() == "343V4.36"


def test_program_memory_has_its_own_form():
    stored = pack_request(2, Instruction(4, 1, 2, -3))
    assert Connection(Line(stored)).read_instruction(17) == Instruction(4, 1, 2, -3)
    with pytest.raises(RefusedError):
        Connection(Line(reply(17, command=134, status=6))).read_instruction(17)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=5))
def test_no_rubbish_raises_anything_but_host_errors(chunks):
    connection = Connection(Line([chunk for chunk in chunks if chunk]), retries=0)
    try:
        connection.execute(GAP)
    except HostError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    "url", ["tcp://127.0.0.1:1", "127.0.0.1:1", "/dev/no-such-port", "/dev/null", "tcp://x:99999"]
)
def test_what_cannot_be_opened_is_one_line(url):
    with pytest.raises(LinkError, match=url) as caught:
        open_stream(url)
    assert "\n" not in str(caught.value)


def test_a_peer_that_hangs_up_is_noticed():
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        Connection.open(f"127.0.0.1:{server.getsockname()[1]}") as connection,
    ):
        server.accept()[0].close()
        with pytest.raises(LinkError, match=r"hung up|reset"):
            connection.command(6, 1)
