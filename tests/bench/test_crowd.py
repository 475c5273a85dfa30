"""A crowd of modules behaves as its rig does when all modules are asked and advanced at each step."""

import random

import pytest

from tmcm34x.bench import build
from tmcm34x.bench.crowd import Crowd
from tmcm34x.bench.description import parse
from tmcm34x.bench.lines import CanEnd, SerialEnd
from tmcm34x.clock import HZ, MS
from tmcm34x.firmware.program import RunState
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import Instruction, pack_can_request, pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import assemble

COUNT = 7
ADDRESSES = (1, 2, 3, 3, 5, 6, 7)
"""Two modules share one."""
BENCH = "seed = 4\n" + "".join(f"[[module]]\naddress = {address}\n" for address in ADDRESSES)
WIRED = """
[module.input]
IN_0 = { kind = "output", output = 1, module = 2 }
SHUTDOWN = { kind = "output", output = 0, module = 0 }
"""
EVENTS = """
[[event]]
at_ms = 700
module = 4
do = "power"
on = false
[[event]]
at_ms = 900
module = 4
do = "power"
on = true
"""
PROGRAM = "Loop: GIO 0, 0\nJC ZE, Loop\nMVP REL, 0, 3000\nWAIT POS, 0, 0\nSGP 66, 0, 9\nWAIT TICKS, 0, 10\nJA Loop\n"
LINES = (
    "GAP 1, 0", "GAP 3, 1", "MVP ABS, 0, 9000", "MVP REL, 1, -700", "ROR 2, 400", "MST 2", "SIO 0, 2, 1",
    "SIO 0, 2, 0", "SIO 1, 2, 1", "SIO 1, 2, 0", "SGP 66, 0, 1", "SGP 66, 0, 5", "SGP 66, 0, 9", "138 0, 0, 1",
    "138 0, 0, 7", "GGP 132, 0", "GGP 133, 0", "SGP 80, 0, 1", "SGP 75, 0, 3", "SGP 75, 0, 0", "SGP 71, 0, 8",
    "SGP 71, 0, 1", "129 1, 0, 0", "128 0, 0, 0", "139 0, 0, 0", "SGP 68, 0, 50", "RFS START, 1", "242 0, 0, 5",
)  # fmt: skip


class Line:
    """A rig with two serial lines and a CAN bus, all modules at each step or as a crowd."""

    def __init__(self, lazy):
        self.rig = build(parse(BENCH + WIRED + EVENTS))
        self.crowd = Crowd(self.rig) if lazy else None
        self.time = self.crowd or self.rig
        self.heard = []
        for index in (1, 5):
            self.rig.modules[index].eeprom.write_program(assemble(PROGRAM).program)
        self.serials = [
            SerialEnd(self.rig, lambda data, n=n: self.note(n, data), only=only, crowd=self.crowd)
            for n, only in enumerate((None, None, 3))
        ]
        self.can = CanEnd(self.rig, self.note, crowd=self.crowd)

    def note(self, *what):
        self.heard.append((self.rig.now, *what))

    def wait(self, clocks):
        until = self.rig.now + clocks
        while (when := self.time.next_event()) <= until:
            self.time.advance(when)
        self.time.advance(until)

    def states(self):
        if self.crowd is not None:
            self.crowd.gather()
            self.crowd.forget()
        self.rig.next_event()
        return self.rig.save()


def telegrams(chance):
    data = b"".join(
        pack_request(chance.choice((*ADDRESSES, 9, 77)), parse_instruction(chance.choice(LINES)))
        for _ in range(chance.choice((1, 1, 1, 2, 3)))
    )
    return data[: chance.randrange(1, len(data))] if chance.random() < 0.05 else data


def act(chance, line):
    if chance.random() < 0.15:
        request = pack_can_request(parse_instruction(chance.choice(LINES)), chance.choice((7, 8)))
        line.can.receive_frame(chance.choice((1, 8, 9)), request)
    else:
        line.serials[chance.randrange(3)].receive(telegrams(chance), over=chance.random() < 0.3)


@pytest.mark.parametrize("seed", range(20))
def test_telegrams_programs_wires_and_events_have_the_same_effects_at_the_same_clocks(seed):
    plain, crowd = Line(lazy=False), Line(lazy=True)
    for line in (plain, crowd):
        chance = random.Random(seed)
        for _ in range(150):
            act(chance, line)
            if chance.random() < 0.7:
                line.wait(chance.choice((1, MS // 3, 2 * MS, 40 * MS)))
        line.wait(HZ)
    assert crowd.heard == plain.heard
    assert len(plain.heard) > 30
    assert crowd.states() == plain.states()


def test_modules_that_are_not_meant_stay_where_they_are():
    line = Line(lazy=True)
    line.time.next_event()
    line.wait(5 * MS)
    line.serials[0].receive(pack_request(6, Instruction(6, 1)))
    assert len(line.heard) == 1
    assert {n for n, module in enumerate(line.rig.modules) if module.now == line.rig.now} == {5}


def test_a_server_of_many_modules_brings_all_of_them_to_the_present_for_others():
    wall_s = 0.0
    server = Server(build(parse(BENCH)), monotonic=lambda: wall_s, lazy=True)
    heard = []
    peer = server.connect("host", heard.append)
    wall_s = 0.5
    peer.receive(pack_request(2, parse_instruction("ROR 0, 500")))
    wall_s = 1.0
    peer.receive(pack_request(2, parse_instruction("GAP 3, 0")))
    assert len(heard) == 2
    assert server.rig.modules[0].now < server.rig.now
    server.catch_up()
    assert {module.now for module in server.rig.modules} == {server.rig.now}
    assert server.rig.now == HZ
    server.rig.modules[3].program.run(0)
    server.settle()
    wall_s = 1.1
    server.catch_up()
    assert server.rig.modules[3].program.state is RunState.STOP
