"""The loop that paces a bench and serves its lines, with a bench of clockwork."""

import asyncio
from types import SimpleNamespace

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.clock import HZ, MS, NEVER
from tmcm34x.server import Server
from tmcm34x.server.lines import Bus


class Wall:
    """A clock on the wall that goes when told."""

    def __init__(self):
        self.time_s = 1000.0

    def __call__(self):
        return self.time_s


class Clockwork:
    """A bench whose only part ticks every `period` clocks; a tick takes `work_s` of the wall's time."""

    def __init__(self, wall, period=MS, work_s=0.0, ticks=NEVER):
        self.ports = []
        self.heard = []
        self.modules = [
            SimpleNamespace(ports=self.ports, heard=self.heard, rig=self, detach=self.ports.remove)
        ]
        self.now = 0
        self.ticks = 0
        self.last = ticks
        self.wall, self.period, self.work_s = wall, period, work_s

    def next_event(self):
        return (self.ticks + 1) * self.period if self.ticks < self.last else NEVER

    def advance(self, now):
        assert self.now <= now <= self.next_event()
        self.now = now
        if now == self.next_event():
            self.ticks += 1
            self.wall.time_s += self.work_s

    def pass_to(self, now):
        assert self.now <= now < self.next_event()
        self.now = now


class Echo:
    """A port that answers what it receives."""

    def __init__(self, module, send, **options):
        self.module = module
        self.send = send
        module.ports.append(self)

    def receive(self, data):
        self.module.heard.append((self.module.rig.now, data))
        self.send(data)


@pytest.fixture(autouse=True)
def echoing_ports(monkeypatch, request):
    if "wall" in request.fixturenames:
        monkeypatch.setattr("tmcm34x.bench.lines.SerialPort", Echo)


@pytest.fixture
def wall():
    return Wall()


def test_catching_up_runs_the_events_and_ends_at_now(wall):
    rig = Clockwork(wall)
    server = Server(rig, monotonic=wall)
    wall.time_s += 0.0105
    assert server.catch_up()
    assert (rig.now, rig.ticks) == (pytest.approx(0.0105 * HZ, abs=1), 10)


def test_work_is_broken_off_after_a_slice(wall):
    rig = Clockwork(wall, work_s=0.00005)
    server = Server(rig, monotonic=wall)
    wall.time_s += 1
    start_s = wall.time_s
    assert not server.catch_up()
    assert wall.time_s - start_s == pytest.approx(0.0002)
    assert rig.ticks == 4


def test_time_that_cannot_be_caught_up_is_given_up(wall):
    """A tick of one virtual millisecond takes ten: after a while the bench must not owe minutes."""
    rig = Clockwork(wall, work_s=0.010)
    server = Server(rig, monotonic=wall)
    for _ in range(1000):
        wall.time_s += 0.001
        server.catch_up()
    assert 0 < wall.time_s - server.pace.due_s(rig.now) <= 1.1


def test_a_process_that_was_stopped_for_a_while_does_not_race_afterwards(wall):
    rig = Clockwork(wall, work_s=0.0003)
    server = Server(rig, monotonic=wall)
    wall.time_s += 3600
    server.catch_up()
    assert wall.time_s - server.pace.due_s(rig.now) < 0.001


def test_bytes_are_heard_at_the_time_when_they_come(wall):
    rig = Clockwork(wall)
    server = Server(rig, monotonic=wall)
    replies = bytearray()
    peer = server.connect("test", replies.extend)
    wall.time_s += 0.25
    peer.receive(b"telegram")
    assert rig.heard == [(HZ // 4, b"telegram")]
    assert replies == b"telegram"


def test_a_client_that_has_gone_gets_nothing_and_costs_nothing(wall):
    rig = Clockwork(wall)
    server = Server(rig, monotonic=wall)
    replies = bytearray()
    peer = server.connect("test", replies.extend)
    (port,) = rig.ports
    peer.disconnect()
    assert not rig.ports
    port.send(b"late")
    assert not replies


def test_at_speed_0_the_events_run_and_then_time_rests(wall):
    rig = Clockwork(wall, ticks=100)
    server = Server(rig, speed=0, monotonic=wall)
    assert server.catch_up()
    assert (rig.ticks, rig.now) == (100, 100 * MS)
    wall.time_s += 1
    server.catch_up()
    assert rig.now == 100 * MS


def test_pace_changes_take_effect_at_once(wall):
    rig = Clockwork(wall)
    server = Server(rig, monotonic=wall)
    wall.time_s += 1
    server.change_pace(paused=True)
    wall.time_s += 1
    server.catch_up()
    assert rig.now == HZ
    server.change_pace(speed=0.5, paused=False)
    wall.time_s += 1
    while not server.catch_up():
        pass
    assert rig.now == HZ * 3 // 2


class QuietLink:
    """A link without clients."""

    kind, latency_ms, baud_rate = "quiet", 0, None

    async def open(self, connect):
        return "nowhere"

    def close(self):
        pass


def test_the_event_loop_sleeps_until_the_next_event_and_no_longer():
    """In real time: ten events of 5 ms, then nothing more to wake up for."""

    async def scenario():
        loop = asyncio.get_running_loop()
        wall = SimpleNamespace(time_s=0.0)
        rig = Clockwork(wall, period=5 * MS, ticks=10)
        start_s = loop.time()
        server = Server(rig)
        await server.open(QuietLink())
        while rig.ticks < 10:
            await asyncio.sleep(0.001)
        assert loop.time() - start_s > 0.048
        before = rig.now
        await asyncio.sleep(0.02)  # four more events, if there were any
        assert rig.now == before
        await server.close()

    asyncio.run(scenario())


# The CAN bus


class Frames:
    """A log that keeps the frames, by the line on which each is written down."""

    def __init__(self):
        self.rows = []

    def write(self, now, name, direction, data, kind):
        self.rows.append((name[:3], direction, data[-7:].hex()))


def test_a_frame_is_logged_once_however_many_clients_the_bus_has():
    log = Frames()
    bus = Bus(Server(simple_rig(), monotonic=float, log=log))
    received = {"one": [], "two": []}
    one, two = (
        bus.connect(name, lambda _, data, n=name: received[n].append(data.hex())) for name in received
    )
    request, reply = "06040000000000", "016406000003e8"
    two.receive_frame(1, bytes.fromhex(request), None)
    assert log.rows == [("two", ">", request), ("two", "<", reply)]
    assert received == {"one": [request, reply], "two": [reply]}
    two.disconnect()
    one.receive_frame(1, bytes.fromhex(request), None)
    assert log.rows[2:] == [("one", ">", request), ("one", "<", reply)]
