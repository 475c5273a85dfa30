"""The wall clock as it should not be: it goes back, leaps ahead, stands still."""

import itertools
import math
import random

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.clock import HZ
from tmcm34x.links.memory import MemoryClient
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import SIZE, Instruction, pack_request, unpack_reply

ASK = pack_request(1, Instruction(10, 66, 0))
TURN = pack_request(1, Instruction(1, 0, 0, 500))


class Wall:
    """A wall clock that a test sets; each look takes a microsecond."""

    def __init__(self):
        self.now_s = 1000.0

    def __call__(self):
        self.now_s += 1e-6
        return self.now_s


@pytest.mark.parametrize("speed", [0.1, 1.0, 1e6])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_clock_that_jumps_costs_time_but_no_reply(speed, seed):
    wall, draw = Wall(), random.Random(seed)
    rig = simple_rig()
    server = Server(rig, speed=speed, monotonic=wall)
    client = MemoryClient(server.connect)
    client.write(TURN)
    client.read()
    before = rig.now
    for _ in range(60):
        wall.now_s += draw.choice([0.0, 1e-9, 0.01, 1.0, -0.01, -1.0, -1e6, 3600.0, 1e6, 1e9])
        for _ in range(200):
            if server.catch_up():
                break
        server.settle()
        assert before <= rig.now
        before = rig.now
        wall.now_s += 1.0
        client.write(ASK)
        reply = client.read()
        assert len(reply) == SIZE
        assert unpack_reply(reply).status == 100
    assert math.isfinite(rig.now)


@pytest.mark.parametrize("speed", [0.001, 1.0, 20.0])
@pytest.mark.parametrize(("pause_ms", "replies"), [(4.9, 1), (5.1, 0)])
def test_a_pause_in_a_telegram_counts_in_the_time_of_its_host(speed, pause_ms, replies):
    wall = Wall()
    client = MemoryClient(Server(simple_rig(), speed=speed, monotonic=wall).connect)
    for byte in ASK:
        wall.now_s += pause_ms / 1000
        client.write(bytes((byte,)))
    assert len(client.read()) == replies * SIZE
    wall.now_s += 0.0051
    client.write(ASK)
    assert unpack_reply(client.read()).status == 100


def test_a_clock_that_stands_still_stands_for_the_module_too():
    rig = simple_rig()
    server = Server(rig, monotonic=itertools.repeat(5.0).__next__)
    client = MemoryClient(server.connect)
    for _ in range(100):
        client.write(ASK)
        assert unpack_reply(client.read()).status == 100
    assert rig.now < HZ
