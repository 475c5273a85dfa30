"""Finding the reply: what lines do to telegrams."""

import socket
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.host import (
    Connection,
    DownloadModeError,
    GarbledReplyError,
    HostError,
    LateReplyError,
    LinkError,
    NoReplyError,
    RefusedError,
)
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_reply, pack_request, unpack_request


class Line:
    """A line that answers each telegram with the next of `answers`: chunks, each from one read; it has its own time."""

    name = "test"
    real = False

    def __init__(self, *answers, waiting=b""):
        self.answers = list(answers)
        self.sent = []
        self.pending = []
        self.stale = waiting
        self.time = 0.0

    def write(self, data):
        self.sent.append(unpack_request(data))
        if self.answers:
            answer = self.answers.pop(0)
            self.pending += answer if isinstance(answer, list) else [answer]

    def read(self, size, timeout_s):
        if self.pending:
            return self.pending.pop(0)
        self.time += timeout_s
        return b""

    def waiting(self):
        stale, self.stale = self.stale, b""
        return stale

    def now(self):
        return self.time

    def sleep(self, seconds):
        self.time += seconds

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


@settings(max_examples=200)
@given(st.binary(max_size=30), st.integers(-(2**31), 2**31 - 1))
def test_stray_bytes_before_a_reply_are_skipped(noise, value):
    connection = Connection(Line([noise, reply(value)] if noise else reply(value)))
    assert connection.execute(GAP).command == 6


PROBE = pack_reply(Reply(2, 1, 100, 136, 343 << 16))


def test_a_late_reply_is_not_taken_for_the_answer_to_a_later_command_of_the_same_number():
    """The first GAP is answered after it was given up: a probe (136) tells its reply from that of the second."""
    line = Line(b"", [reply(111), PROBE], reply(222))
    connection = Connection(line, retries=0)
    with pytest.raises(NoReplyError):
        connection.command(6, 1)
    assert connection.command(6, 4) == 222
    assert [instruction.number for _, instruction in line.sent] == [6, 136, 6]
    assert connection.counts.late == 1


def test_late_replies_to_a_repeated_probe_are_late_and_those_of_no_other_host():
    """A module that is slow once answers three probes, the last two before what is asked then."""
    line = Line(b"", b"", b"", [PROBE], [PROBE, PROBE, reply(222)], reply(333, command=10))
    connection = Connection(line, retries=3)
    with pytest.raises(NoReplyError):
        connection.ask(Instruction(6, 1), retries=0)
    assert connection.command(6, 4) == 222
    assert connection.command(10, 66) == 333
    assert [instruction.number for _, instruction in line.sent] == [6, 136, 136, 136, 6, 10]
    assert (connection.counts.late, connection.counts.misdirected) == (2, 0)


def test_no_probe_is_needed_where_the_command_number_tells():
    line = Line(b"", [reply(1, command=4), reply(7)])
    connection = Connection(line)
    with pytest.raises(NoReplyError):
        connection.command(4, 1, 0, 100)
    assert connection.command(6, 1) == 7
    assert len(line.sent) == 2


def test_a_damaged_late_reply_of_an_earlier_command_repeats_no_motion():
    """The status 1 belongs to the command before: the motion is not sent a second time."""
    line = Line(b"", [reply(0, command=0, status=1), reply(100, command=4)])
    connection = Connection(line, retries=0)
    with pytest.raises(NoReplyError):
        connection.command(5, 4, 0, 1)
    assert connection.command(4, 1, 0, 100) == 100
    assert len(line.sent) == 2


def test_what_stops_a_motor_goes_out_at_once():
    """MST 1 does not wait until it is known whether MST 0 was answered; its own reply is still told apart."""
    line = Line(b"", [reply(0, command=3)], [reply(0, command=3)])
    connection = Connection(line)
    with pytest.raises(NoReplyError):
        connection.command(3, 0, 0)
    with pytest.raises(LateReplyError):
        connection.command(3, 0, 1)
    assert connection.command(3, 0, 1) == 0
    assert [instruction.number for _, instruction in line.sent] == [3, 3, 3]


def test_a_command_is_sent_also_when_no_probe_is_answered():
    """Or replies that were switched off could not be switched on again."""
    line = Line(b"", b"", reply(0, command=9))
    connection = Connection(line, retries=0)
    with pytest.raises(NoReplyError):
        connection.command(9, 255, 0, 1)
    with pytest.raises(LateReplyError, match="may be those of earlier"):
        connection.command(9, 255, 0, 0)
    assert [instruction.number for _, instruction in line.sent] == [9, 136, 9]


def test_answers_that_are_always_too_late_say_so():
    line = Line(b"", [reply(1)], b"", b"")
    connection = Connection(line, retries=0)
    with pytest.raises(NoReplyError):
        connection.command(6, 1)
    with pytest.raises(LateReplyError, match="raise the time-out"):
        connection.command(6, 4)


def test_replies_to_commands_of_another_host_are_recognized():
    line = Line([reply(1, command=5), reply(2, command=10)])
    with pytest.raises(GarbledReplyError, match="another host"):
        Connection(line, retries=0).command(6, 1)


def test_a_stored_instruction_is_not_looked_for_in_noise():
    """134 has neither status nor command in its reply: behind a stray byte it is asked for again."""
    stored = pack_request(2, Instruction(4, 1, 2, -3))
    connection = Connection(Line([b"\x07" + stored], stored))
    assert connection.read_instruction(17) == Instruction(4, 1, 2, -3)
    assert connection.counts.retried == 1


def test_a_stored_instruction_comes_from_the_host_address_of_earlier_replies():
    other, stored = pack_request(9, Instruction(4, 1, 2, -3)), pack_request(2, Instruction(28))
    connection = Connection(Line(reply(0), other, stored))
    connection.command(6, 1)
    assert connection.read_instruction(0) == Instruction(28)


def test_download_mode_is_recognized():
    with pytest.raises(DownloadModeError, match="download mode"):
        Connection(Line(reply(0, status=101))).command(6, 1)
    with pytest.raises(DownloadModeError):
        Connection(Line(reply(0, command=128, status=6))).command(128)


def test_the_address_may_change_with_the_reply():
    assert Connection(Line(reply(7, command=9, address=7))).command(9, 66, 0, 7) == 7


def test_every_telegram_is_shown_to_listeners():
    seen = []
    connection = Connection(Line(reply(0, status=1), reply(5)))
    connection.listeners.append(lambda sent, data: seen.append((sent, data[3] if not sent else data[1])))
    connection.command(6, 1)
    assert seen == [(True, 6), (False, 6), (True, 6), (False, 6)]


@settings(max_examples=300)
@given(st.data())
def test_a_line_with_faults_gives_right_values_or_an_error(data):
    """Replies are dropped, damaged, delayed past the time-out, doubled, split; a value that comes back is right."""
    line = Faulty(data)
    connection = Connection(line, retries=3)
    for number in range(8):
        try:
            answer = connection.command(data.draw(st.sampled_from([6, 10])), number)
        except HostError:
            continue
        assert answer == number


class Faulty(Line):
    """Answers a command with its type as the value, through drawn faults."""

    def __init__(self, data):
        super().__init__()
        self.data = data
        self.late = []

    def write(self, data):
        _, instruction = unpack_request(data)
        answer = reply(instruction.type, command=instruction.number)
        self.pending += self.late
        self.late = []
        fault = self.data.draw(
            st.sampled_from(["none", "none", "drop", "garble", "late", "double", "split", "noise"])
        )
        match fault:
            case "none":
                self.pending.append(answer)
            case "garble":
                self.pending.append(answer[:4] + bytes((answer[4] ^ 0x10,)) + answer[5:])
            case "late":
                self.late.append(answer)
            case "double":
                self.pending.append(answer + answer)
            case "split":
                self.pending += [answer[:5], answer[5:]]
            case "noise":
                self.pending += [b"\x00\xff\x02", answer]


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
    connection = Connection(line)
    assert connection.command(6, 1) == 3
    assert (connection.counts.sent, connection.counts.retried, connection.counts.garbled) == (3, 2, 1)


def test_a_motion_is_not_tried_again_after_silence():
    line = Line(b"", reply(3, command=4))
    with pytest.raises(NoReplyError, match="MVP REL, 0, 100: no reply in time; check power"):
        Connection(line).command(4, 1, 0, 100)
    assert len(line.sent) == 1


def test_bytes_that_are_no_reply_are_shown():
    with pytest.raises(GarbledReplyError, match="GAP 1, 0: no reply in 41 42"):
        Connection(Line(b"AB"), retries=0).execute(GAP)


def test_events_are_kept_wherever_they_come():
    connection = Connection(Line([EVENT + reply(1)], waiting=EVENT))
    assert connection.command(6, 1) == 1
    assert [event.value for event in connection.events] == [1, 1]


def test_an_event_right_behind_the_reply_is_kept():
    connection = Connection(Line(reply(1, command=138) + EVENT))
    connection.command(138, 0, 0, 1)
    assert len(connection.events) == 1


def test_the_version_string_has_its_own_form():
    assert Connection(Line([b"\x00\x02343V4.36"])).version() == "343V4.36"


def test_program_memory_has_its_own_form():
    stored = pack_request(2, Instruction(4, 1, 2, -3))
    assert Connection(Line(stored)).read_instruction(17) == Instruction(4, 1, 2, -3)
    with pytest.raises(RefusedError):
        Connection(Line(reply(17, command=134, status=6))).read_instruction(17)


@settings(max_examples=200)
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
    with pytest.raises(LinkError, match=url.replace("//", "/*")) as caught:
        Connection.open(url)
    assert "\n" not in str(caught.value)


def test_a_peer_that_hangs_up_is_noticed():
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        Connection.open(f"127.0.0.1:{server.getsockname()[1]}") as connection,
    ):
        server.accept()[0].close()
        with pytest.raises(LinkError, match=r"hung up|reset"):
            connection.command(6, 1)


def test_what_is_urgent_goes_out_while_another_thread_waits():
    server = socket.create_server(("127.0.0.1", 0))
    url = f"tcp:127.0.0.1:{server.getsockname()[1]}"
    with server, Connection.open(url, retries=0, timeout=10) as connection, ThreadPoolExecutor(1) as pool:
        peer, _ = server.accept()
        with peer:
            waiting = pool.submit(connection.command, 6, 1)
            assert unpack_request(peer.recv(9, socket.MSG_WAITALL))[1] == GAP
            connection.urgent([Instruction(128), Instruction(3, 0, 2)])
            urgent = peer.recv(18, socket.MSG_WAITALL)
            assert (urgent[1], urgent[10], urgent[12]) == (128, 3, 2)
            peer.sendall(reply(77) + reply(0, command=128) + reply(0, command=3))
            assert waiting.result() == 77
            waiting = pool.submit(connection.command, 6, 4)
            peer.recv(9, socket.MSG_WAITALL)
            peer.sendall(reply(5))
            assert waiting.result() == 5


class InTurn(int):
    """The number of a command; while it is looked at, another thread has its turn and sends something urgent."""

    def __eq__(self, other):
        self.connection.urgent([Instruction(3, 0, 1)])
        return int(self) == other

    __hash__ = int.__hash__


def test_urgent_commands_of_another_thread_upset_no_command_that_is_under_way():
    line = Line()
    connection = Connection(line)
    number = InTurn(3)
    number.connection = connection
    connection.urgent([Instruction(number)])
    line.answers = [reply(7, 10)]
    assert connection.command(10, 66) == 7
    assert len(line.sent) > 2
