"""Lines at a bit rate, in virtual time: every byte has its moment."""

import asyncio

import pytest

from tmcm34x import clock
from tmcm34x.bench import simple_rig
from tmcm34x.links.memory import MemoryClient
from tmcm34x.links.pacing import pace
from tmcm34x.links.timing import LoopTiming, VirtualTiming
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.global_parameters import BAUD_RATES

REQUEST = pack_request(1, Instruction(6, 4, 0))


class Line:
    """A module on a paced line in memory."""

    def __init__(self, timing=None):
        self.rig = simple_rig()
        self.timing = timing or VirtualTiming()
        self.server = Server(self.rig, monotonic=self.timing.time, paced=True)
        module = self.rig.modules[0]
        self.received = []
        connect = pace(self.server.connect, lambda: BAUD_RATES[module.baud_index], self.timing)
        self.client = MemoryClient(connect)

    def reply_s(self):
        """When the next reply came [s]."""
        while not self.client.read():
            self.timing.advance(self.timing.next_event())
        return self.timing.time()

    def run(self, seconds):
        """When each piece of the replies came [s]."""
        came = []
        end = self.timing.now + clock.clocks(seconds)
        while (when := self.timing.next_event()) <= end:
            self.timing.advance(when)
            if data := self.client.read():
                came.append((self.timing.time(), data))
        self.timing.advance(end)
        return came


def characters(count, rate=9600):
    return pytest.approx(count * 10 / rate, abs=2e-6)


def test_a_round_trip_takes_nineteen_characters():
    line = Line()
    line.client.write(REQUEST)
    ((when, reply),) = line.run(1)
    assert (when, len(reply)) == (characters(9 + 1 + 9), 9)


def test_a_reply_begins_when_its_request_has_come_and_the_line_is_free():
    line = Line()
    line.client.write(3 * REQUEST)
    assert [when for when, _ in line.run(1)] == [characters(19), characters(28), characters(37)]


def test_the_command_is_executed_when_its_last_bit_has_come():
    line = Line()
    line.client.write(pack_request(1, Instruction(14, 3, 2, 1)))
    line.run(0.00937)
    assert line.rig.modules[0].board.outputs == 0
    line.run(0.00001)
    assert line.rig.modules[0].board.outputs == 1 << 3


def test_bytes_that_follow_each_other_are_one_telegram():
    line = Line()
    line.client.write(REQUEST[:1])
    line.client.write(REQUEST[1:])
    ((when, _),) = line.run(1)
    assert when == characters(19)


def test_a_pause_within_a_telegram_ends_it():
    line = Line()
    line.client.write(REQUEST[:4])
    line.run(0.1)
    line.client.write(REQUEST[4:])
    assert line.run(1) == []
    line.client.write(REQUEST)
    assert len(line.run(1)) == 1


class LateTiming(VirtualTiming):
    """The timers of a busy computer: each a millisecond late."""

    def call_later(self, delay_s, action):
        super().call_later(delay_s + 0.001, action)


def test_what_timers_are_late_does_not_add_up():
    line = Line(LateTiming())
    for count in range(1, 6):
        line.client.write(REQUEST)
        assert line.reply_s() - 0.001 == characters(19 * count)


@pytest.mark.parametrize("index", range(len(BAUD_RATES)))
def test_another_bit_rate_counts_after_the_reply_to_its_command(index):
    line = Line()
    line.client.write(pack_request(1, Instruction(9, 65, 0, index)))
    ((_, reply),) = line.run(1)
    assert reply[2] == 100
    start = line.timing.time()
    line.client.write(REQUEST)
    ((when, _),) = line.run(1)
    assert when - start == characters(19, BAUD_RATES[index])


def test_what_is_on_its_way_when_the_client_goes_is_lost():
    line = Line()
    line.client.write(REQUEST)
    line.client.close()
    assert line.run(1) == []


def test_the_timers_of_an_event_loop_are_not_early_and_keep_their_order(monkeypatch):
    async def scenario():
        loop = asyncio.get_running_loop()
        timing, done = LoopTiming(loop), loop.create_future()
        fired = []
        now = timing.time()
        with monkeypatch.context() as patch:
            patch.setattr(loop, "time", lambda: now)  # a busy machine may take long from one call to the next
            for delay_s in (0.004, 0.0, 0.002, 0.0021, 0.0022):
                timing.call_later(delay_s, lambda delay_s=delay_s: fired.append((delay_s, timing.time())))
            timing.call_later(0.006, lambda: done.set_result(None))
        await done
        assert [delay_s for delay_s, _ in fired] == [0.0, 0.002, 0.0021, 0.0022, 0.004]
        assert all(when >= now + delay_s for delay_s, when in fired)

    asyncio.run(scenario())
