"""A module's state is a plain value: taken out, put back, copied, compared."""

import copy
import pickle
import random

import pytest

from firmware.hosts import Host, switched_on
from tmcm34x import clock
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.boot import BootLoader
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.tmcl.commands import BOOT_KEY
from tmcm34x.tmcl.datagram import Instruction, pack_can_request, pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.tmcl.numbers import AP, COMMAND, CONTROL, GP

PROGRAM = """
ROR 1, 300
WAIT TICKS, 0, 2
GGP 133, 0
AGP 3, 2
GAP 1, 0
COMP 500
JC GT, 9
MVP REL, 0, 700
WAIT POS, 0, 30
CALC ADD, 3
AGP 4, 2
GIO 0, 0
CSUB 14
JA 1
CALCX SWAP
WAIT REFSW, 2, 3
RSUB
"""


class Bench:
    """A module with hosts on a serial line and on CAN, and whatever a seed has them do."""

    def __init__(self, model, profile="standard"):
        self.module = switched_on(model, profile=profile)
        BootLoader(self.module)
        self.heard = []
        self.host = Host(self.module)
        self.host.port.send = lambda data: self.heard.append((self.module.now, data))
        self.can = CanPort(self.module, lambda identifier, data: self.heard.append((identifier, data)))

    def send(self, line):
        self.host.port.receive(pack_request(1, parse_instruction(line)))

    def do(self, chance):
        getattr(self, chance.choice(OPERATIONS))(chance)

    def move(self, chance):
        motor = chance.randrange(3)
        self.send(
            chance.choice(
                (
                    f"MVP ABS, {motor}, {chance.randint(-20000, 20000)}",
                    f"ROR {motor}, {chance.randint(-800, 800)}",
                    f"MST {motor}",
                    f"RFS START, {motor}",
                    f"138 0, 0, {chance.randrange(8)}",
                    f"MVP COORD, {chance.choice((0x83, 0x46, 0x87))}, {chance.randrange(21)}",
                )
            )
        )

    def set(self, chance):
        motor = chance.randrange(3)
        number, low, high = chance.choice((
            (AP.MAX_SPEED, 0, 2047), (AP.MAX_ACCELERATION, 1, 2047), (AP.STALL_THRESHOLD, 0, 7),
            (AP.POWER_DOWN_DELAY, 1, 20), (AP.MIXED_DECAY_THRESHOLD, -1, 2048), (AP.GROUP_INDEX, 0, 1),
            (AP.PULSE_DIVISOR, 2, 5), (AP.RAMP_MODE, 0, 2), (AP.REFERENCE_MODE, 1, 3),
        ))  # fmt: skip
        self.send(f"SAP {number}, {motor}, {chance.randint(low, high)}")
        self.send(f"STAP {number}, {motor}")

    def settings(self, chance):
        number, value = chance.choice((
            (GP.TELEGRAM_PAUSE, 7), (GP.TELEGRAM_PAUSE, 0), (GP.SERIAL_HEARTBEAT, 50), (GP.SERIAL_HEARTBEAT, 0),
            (GP.COORDINATE_STORAGE, 1), (GP.SHUTDOWN_PIN, 1), (GP.TICK_TIMER, 77), (GP.ENCODER_INTERFACE, 1),
            (GP.MICROSTEP_TABLE_0 + 3, 0x01020304),
        ))  # fmt: skip
        self.send(f"SGP {number}, 0, {value}")
        self.send(f"CCO {chance.randrange(21)}, 7")

    def look(self, chance):
        for line in ("GAP 1, 0", "GGP 133, 0", "GAP 206, 1", "GGP 132, 0", "GIO 255, 0", "135 0, 0, 0"):
            self.send(line)
        self.can.receive_frame(1, pack_can_request(Instruction(COMMAND.GAP, 3, chance.randrange(3))))

    def pins(self, chance):
        board = self.module.board
        board.set_switch(chance.randrange(3), chance.choice(("left", "right")), chance.random() < 0.5)
        board.set_input(chance.randrange(8), chance.randrange(2))
        board.set_shutdown(int(chance.random() < 0.1))

    def program(self, chance):
        if chance.random() < 0.5:
            lines = PROGRAM.strip().splitlines()
            self.send("132 0, 0, 0")
            for line in lines[: chance.randint(3, len(lines))]:
                self.send(line)
            if chance.random() < 0.7:
                self.send("133 0, 0, 0")
        else:
            self.send(
                chance.choice(("133 0, 0, 0", "129 1, 0, 0", "128 0, 0, 0", "130 0, 0, 0", "131 0, 0, 0"))
            )

    def rubbish(self, chance):
        self.host.port.receive(chance.randbytes(chance.randint(1, 8)))

    def ascii(self, chance):
        self.send("139 0, 0, 0")
        self.host.port.receive(b"AGAP 1, 0\rAGA")
        if chance.random() < 0.7:
            self.host.port.receive(b"\rABIN\r")

    def boot(self, chance):
        if chance.random() < 0.2:
            enter = Instruction(CONTROL.ENTER_BOOT_LOADER, *BOOT_KEY)
            self.host.port.receive(pack_request(1, enter))
            for instruction in (Instruction(200), Instruction(201, 3, 0, 99), Instruction(202, 0, 0, 0x4000)):
                self.host.port.receive(pack_request(1, instruction))

    def power(self, chance):
        if chance.random() < 0.2:
            self.module.power_off()
            self.module.power_on()

    def wait(self, chance, slices=1):
        until = self.module.now + chance.randint(1, 400 * MS)
        for n in range(1, slices):
            run_until(self.module, self.module.now + (until - self.module.now) * n // slices)
        run_until(self.module, until)


OPERATIONS = ("move", "set", "settings", "look", "pins", "program", "rubbish", "ascii", "boot", "power")


@pytest.mark.parametrize("model", [341, 342, 343])
@pytest.mark.parametrize("seed", range(12))
def test_a_module_that_was_loaded_goes_on_as_the_one_that_was_saved(model, seed):
    profile = ("standard", "later")[seed % 2]
    chance, bench, other = random.Random(seed), Bench(model, profile), Bench(model, profile)
    for _ in range(chance.randint(3, 25)):
        bench.do(chance)
        bench.wait(chance)
    bench.do(chance)
    before = bench.module.save()
    assert bench.module.save() == before
    other.module.load(clock.unpack(clock.pack(before)))
    assert other.module.digest() == bench.module.digest()
    again = random.Random()
    again.setstate(chance.getstate())
    bench.heard.clear()
    for each, dice, slices in ((bench, chance, 1), (other, again, 3)):
        for _ in range(15):
            each.wait(dice, slices)
            each.do(dice)
    assert other.heard == bench.heard
    assert other.module.save() == bench.module.save()


@pytest.mark.parametrize("seed", range(12))
def test_asking_for_the_next_event_acts_on_nothing(seed):
    chance, bench, other = random.Random(seed), Bench(343), Bench(343)
    again = random.Random(seed)
    for _ in range(25):
        bench.do(chance)
        module = bench.module
        digest, event = module.digest(), module.next_event()
        assert (module.next_event(), module.digest()) == (event, digest)
        bench.wait(chance)
        other.do(again)
        other.wait(again)
    assert other.heard == bench.heard
    assert other.module.save() == bench.module.save()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda module: pickle.loads(pickle.dumps(module))])
@pytest.mark.parametrize("seed", range(5))
def test_a_copy_is_a_module_of_its_own(copied, seed):
    chance, bench = random.Random(seed), Bench(343)
    for _ in range(12):
        bench.do(chance)
        bench.wait(chance)
    bench.module.observers.append(Recorder())
    before = bench.module.save()
    twin = copied(bench.module)
    assert twin.save() == before
    assert not twin.observers
    bench.heard.clear()
    twin.ports[0].receive(pack_request(1, Instruction(COMMAND.ROR, 0, 0, 500)))
    twin.execute(Instruction(COMMAND.MVP, 0, 1, 30000))
    run_until(twin, twin.now + 500 * MS)
    assert twin.save() != before
    assert bench.module.save() == before
    assert bench.heard == []
    run_until(bench.module, twin.now)


class Recorder:
    instruction = None

    def telegram(self, port, direction, data, now):
        pass

    def event(self, kind, motor, now):
        pass


def test_a_saved_state_is_small():
    bench = Bench(343)
    for line in ("ROR 0, 500", "MVP ABS, 1, 50000", "RFS START, 2"):
        bench.send(line)
    run_until(bench.module, 100 * MS)
    assert len(clock.pack(bench.module.save())) < 1 << 15
