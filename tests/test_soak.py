"""Random commands, programs, faults and power cycles: nothing stored is lost, nothing wedges, every run is the same.

`SOAK_HOURS=168 pytest tests/test_soak.py` (or `make soak`) plays a week; the suite plays minutes (docs/sessions.md).
"""

import hashlib
import os
import random

import msgspec
import pytest
from conformance import COMMANDS

from tmcm34x import clock
from tmcm34x.bench import build
from tmcm34x.bench.description import parse
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import COORDINATES, PROGRAM_SIZE, USER_VARIABLES
from tmcm34x.tmcl.datagram import SIZE, Instruction, pack_request, unpack_reply
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.mnemonic import parse_instruction

HOURS = float(os.environ.get("SOAK_HOURS", "0.5"))
MODELS = (341, 342, 343)

BENCH = """
[[module]]
spi = { SPI_SEL0 = { kind = "tmcm323" }, SPI_SEL1 = { kind = "echo" } }

[module.input]
IN_0 = { kind = "sine", period_ms = 700 }
IN_1 = { kind = "square", period_ms = 130 }
IN_2 = { kind = "output", output = 3 }
IN_3 = { kind = "position", motor = 1, low = 0, high = 100 }

[[module.axis]]
load = { kind = "carriage", low = -2, high = 102, start = 40, friction_n = 4 }
switch.left = { position = 0, hysteresis = 0.1 }
switch.right = { position = 100, hysteresis = 0.1 }
switch.reference = { position = 20, width = 3, hysteresis = 0.1 }
switch.bounce_ms = 2
encoder = { lines = 500 }

[[module.axis]]
load = { kind = "carriage", low = 0, high = 100, start = 50, force = 3.0 }
encoder = { lines = 800, slip = 0.1 }

[[module.axis]]
load = { kind = "turntable", ratio = 5 }
switch.left = { position = 0, width = 10, hysteresis = 0.5 }
"""

SAME_CLOCK = 1000
"""More events than this at one clock are a module that goes round in circles."""
EEPROM_GLOBALS = [row for row in GLOBAL_PARAMETERS if row.bank == 0 and row.stored]
TALK = {64, 65, 66, 67, 73, 76}
"""Parameters with which the host would lose its module, or that have an operation of their own here."""
SET_PAUSE = (9, 75)
SETTINGS = [row for row in EEPROM_GLOBALS if row.number not in TALK]
STORED = [row for row in AXIS_PARAMETERS if row.stored]
STORING = {"STAP", "SGP", "AGP", "STGP", "SCO", "CCO", "ACO"}
ANYWHERE = [row for row in COMMANDS if row.mnemonic not in STORING]
DIRECT = [row for row in ANYWHERE if "direct" in row.where]
FAULTS = ("open_load_a", "open_load_b", "short_a", "short_to_ground", "under_voltage", "over_temperature")


class WedgedError(AssertionError):
    """A module that does not go on or does not answer."""


class Soak:
    """One host with its module; everything comes from `seed`.

    slices: a second source of random numbers, for times at which the run is cut without anything happening
    snapshots: another one, for times at which a bench that was built anew goes on from a snapshot of this one
    """

    def __init__(self, model, seed, slices=None, snapshots=None):
        self.model = model
        self.random = random.Random(seed)
        self.slices = slices and random.Random(slices)
        self.snapshots = snapshots and random.Random(snapshots)
        self.received = bytearray()
        self.build()
        self.digest = hashlib.blake2b()
        self.book = Book(model)
        self.operations = 0

    def build(self):
        """A new bench, and the host on its line."""
        bench = parse(BENCH)
        self.rig = build(
            msgspec.structs.replace(
                bench, module=[msgspec.structs.replace(bench.module[0], model=self.model)]
            )
        )
        self.module, self.world = self.rig.modules[0], self.rig.worlds[0]
        self.port = SerialPort(self.module, self.received.extend)

    def replace(self):
        """Go on with another bench, from a snapshot; now and then back and forth again on the old one."""
        old, data, digest = self.rig, self.rig.snapshot(), self.rig.digest()
        if self.snapshots.random() < 0.5:
            self.build()
        else:
            received = bytes(self.received)
            old.advance(min(old.next_event(), old.now + clock.HZ))
            self.received[:] = received
        self.rig.restore(data)
        assert self.rig.digest() == digest

    def play(self, hours):
        """Do random things for so long, then look at everything."""
        self.longest_rest_s = max(60, min(600, int(hours * 72)))
        names, weights = zip(*OPERATIONS.items(), strict=True)
        while self.rig.now < hours * 3600 * clock.HZ:
            if self.snapshots is not None and self.snapshots.random() < 0.1:
                self.replace()
            name = self.random.choices(names, weights)[0]
            getattr(self, name)()
            self.operations += 1
            self.note(name.encode())
        self.cycle()
        self.compare_over_the_wire()
        self.note(self.module.eeprom.to_bytes())
        return self.digest.hexdigest()

    # The wire

    def ask(self, instruction, *, replies=1):
        """Send a telegram, take the replies; an older answer of command 138 may come between."""
        self.port.receive(pack_request(1, instruction))
        if self.book.settings[75] or instruction[:2] == SET_PAUSE:
            self.run(256 * clock.MS)
        answers = [unpack_reply(self.received[n : n + SIZE]) for n in range(0, len(self.received), SIZE)]
        self.note(self.received)
        self.received.clear()
        answers = [answer for answer in answers if answer.status != 128]
        if len(answers) != replies:
            raise WedgedError(f"{instruction} was answered by {answers}")
        return answers[0] if replies else None

    def do(self, text):
        """Send a command given as text; its reply."""
        return self.ask(parse_instruction(text))

    def note(self, data):
        self.digest.update(data)
        self.digest.update(b"%d;" % self.rig.now)

    def run(self, clocks):
        """Let time pass."""
        until = self.rig.now + clocks
        if self.slices is not None:
            for _ in range(self.slices.randrange(3)):
                self.run_until(self.slices.randint(self.rig.now, until))
        self.run_until(until)

    def run_until(self, until):
        rig, last, same = self.rig, -1, 0
        while (when := rig.next_event()) <= until:
            same = same + 1 if when == last else 0
            if when < rig.now or same > SAME_CLOCK:
                raise WedgedError(f"event at {when} at clock {rig.now}, {same} times")
            last = when
            rig.advance(when)
        rig.advance(until)

    # Operations

    def value(self, low, high):
        """A value that is mostly in its range, often at an end."""
        chance = self.random.random()
        if chance < 0.1:
            return self.random.choice((low, high))
        if chance < 0.15:
            return self.random.randint(-(2**31), 2**31 - 1)
        return self.random.randint(low, high)

    def instruction(self, rows):
        """A random command."""
        row = self.random.choice(rows)
        fields = {"type": 0, "motor": 0, "value": 0}
        for operand in row.operands:
            low, high = operand.low, operand.high
            if operand.kind == "axis_parameter":
                parameter = self.random.choice(AXIS_PARAMETERS)
                fields["type"] = parameter.number
                fields["value"] = self.value(parameter.low, parameter.high)
            elif operand.field == "value" and row.mnemonic in {"SAP", "MVP"}:
                if row.mnemonic == "MVP":
                    fields["value"] = self.random.choice(
                        (self.random.randint(-200000, 200000), self.value(0, 20))
                    )
            elif operand.kind == "motor":
                fields["motor"] = self.random.choice((0, 1, 2, 0, 1, 2, self.value(0, 255) & 255))
            elif operand.kind == "bank":
                fields["motor"] = self.random.choice((0, 1, 2))
            else:
                fields[operand.field] = self.value(low, high)
        return Instruction(row.number, fields["type"] & 255, fields["motor"] & 255, fields["value"])

    def command(self):
        """Anything a host may send, apart from what stores and what ends the conversation."""
        self.ask(self.instruction(DIRECT))

    def move(self):
        """A motion command that means something."""
        motor = self.random.randrange(3)
        self.do(
            self.random.choice((
                f"ROR {motor}, {self.random.randint(-2047, 2047)}",
                f"MVP ABS, {motor}, {self.random.randint(-100000, 100000)}",
                f"MVP REL, {motor}, {self.random.randint(-3000, 3000)}",
                f"MST {motor}",
                f"RFS START, {motor}",
                f"RFS STOP, {motor}",
                f"SAP 205, {motor}, {self.random.randint(0, 7)}",
                f"SAP 4, {motor}, {self.random.randint(1, 2047)}",
                f"138 0, 0, {self.random.randint(0, 7)}",
            ))
        )  # fmt: skip

    def unknown(self):
        """A command number that is none, or is not for a host."""
        number = self.random.choice((0, 16, 20, 21, 27, 28, 37, 72, 99, 127, 140, 200, 255))
        status = self.ask(Instruction(number, self.random.randrange(256), self.random.randrange(256))).status
        assert status in {2, 6}

    def noise(self):
        """Bytes that are no telegram for the module, and the silence that ends them."""
        count = self.random.randint(1, 8)
        self.port.receive(bytes(self.random.choice((0, 2, 85, 255)) for _ in range(count)))
        self.run(20 * clock.MS)
        if any(reply.status != 128 for reply in self.take_late()):
            raise WedgedError("noise was answered")

    def take_late(self):
        """Second replies of command 138."""
        late = [unpack_reply(self.received[n : n + SIZE]) for n in range(0, len(self.received), SIZE)]
        self.note(self.received)
        self.received.clear()
        return late

    def wait(self):
        """A moment."""
        self.run(self.random.choice((1, 100, 16_000, 160_000, 1_600_000, 16_000_000)))
        self.take_late()

    def rest(self):
        """A long rest: the program stops, motors mostly."""
        self.do("128")
        for motor in range(3):
            if self.random.random() < 0.9:
                self.do(f"MST {motor}")
                self.do(f"RFS STOP, {motor}")
        moving = any(self.do(f"GAP 2, {motor}").value for motor in range(3))
        longest_s = 60 if moving else self.longest_rest_s
        self.run(self.random.randint(1, longest_s) * clock.HZ)
        self.take_late()

    def world_event(self):
        """Somebody's hand on the machine."""
        motor, side = self.random.randrange(3), self.random.choice(("left", "right"))
        kind = self.random.choice(("switch", "unplug", "fault", "push", "take", "level", "shutdown"))
        if kind == "switch":
            self.world.set_switch(motor, side, self.random.choice((True, False, None, None)))
        elif kind == "unplug":
            self.world.unplug(motor, side, self.random.random() < 0.3)
        elif kind == "fault" and self.model != 342:
            self.world.set_fault(motor, self.random.choice(FAULTS), self.random.random() < 0.3)
        elif kind == "push":
            self.world.push(motor, self.random.choice((0, 0, 0.1, -0.2, 2)))
        elif kind == "take":
            self.world.move(motor, self.random.uniform(0, 100))
        elif kind == "level":
            self.world.set_level(self.random.randrange(8), self.random.choice((None, 0, 500, 1023)))
        else:
            self.world.set_level(8, self.random.choice((0, 0, 0, 0, 1023)))

    def program(self):
        """Another program, somewhere in the memory, and away with it."""
        address = self.random.randrange(PROGRAM_SIZE - 40)
        if self.book.settings[81] & 2:
            assert self.do(f"132 0, 0, {address}").status == 6
            return
        assert self.do(f"132 0, 0, {address}").status == 100
        for offset in range(self.random.randint(1, 30)):
            instruction = self.instruction(ANYWHERE)
            if self.random.random() < 0.2:
                instruction = parse_instruction(f"WAIT TICKS, 0, {self.random.randint(0, 50)}")
            elif instruction.number in {21, 22, 23}:
                instruction = instruction._replace(value=address + self.random.randrange(30))
            assert self.ask(instruction).status == 101
            self.book.program[address + offset] = instruction
        assert self.do("133").status == 100
        assert self.do(f"129 1, 0, {address}").status == 100

    def control(self):
        """Run, stop, step, reset, ask."""
        self.do(self.random.choice(("128", "129", "130", "131", "135", "136 1, 0, 0", "134 0, 0, 5000")))

    # What is stored

    def hold_program(self):
        """With a telegram pause a program could change a value between the host's reading and storing it."""
        if self.book.settings[75]:
            self.do("128")

    def store_axis(self):
        """STAP."""
        self.hold_program()
        row, motor = self.random.choice(STORED), self.random.randrange(3)
        value = self.do(f"GAP {row.number}, {motor}")
        status = self.do(f"STAP {row.number}, {motor}").status
        assert status == (3 if self.model not in row.models else 5 if self.book.locked else 100)
        if status == 100:
            self.book.axes[motor][row.number] = value.value

    def store_global(self):
        """SGP in bank 0."""
        row = self.random.choice(SETTINGS)
        value = self.value(row.low, row.high)
        status = self.do(f"SGP {row.number}, 0, {value}").status
        assert status == (5 if self.book.locked else 100 if row.low <= value <= row.high else 4)
        if status == 100:
            if row.number == 81 and self.book.settings[81] & 1 and not value & 1:
                self.book.program = [Instruction(0)] * PROGRAM_SIZE
            self.book.settings[row.number] = value

    def lock(self):
        """The EEPROM lock; mostly open."""
        key, locked = self.random.choice(((1234, 1), (4321, 0), (4321, 0), (4321, 0)))
        assert self.do(f"SGP 73, 0, {key}").status == 100
        self.book.settings[73] = locked

    def store_variable(self):
        """STGP of a user variable."""
        self.hold_program()
        number = self.random.randrange(USER_VARIABLES)
        value = self.do(f"GGP {number}, 2").value
        status = self.do(f"STGP {number}, 2").status
        assert status == (5 if self.book.locked else 100)
        if status == 100:
            self.book.variables[number] = value

    def store_coordinate(self):
        """SCO, which stores with parameter 84 at 1; with 0 the copy of one does."""
        self.hold_program()
        number, motor = self.random.randint(1, COORDINATES - 1), self.random.randrange(3)
        value = self.random.randint(-(2**23), 2**23 - 1)
        kept = self.book.settings[84]
        status = self.do(f"SCO {number}, {motor}, {value}").status
        assert status == (5 if kept and self.book.locked else 100)
        if kept and status == 100:
            self.book.coordinates[motor][number] = value
        if not kept:
            values = [self.do(f"GCO {number}, {each}").value for each in range(3)]
            if self.do(f"SCO {number}, 255, 0").status == 100:
                for each in range(3):
                    self.book.coordinates[each][number] = values[each]

    def forget(self):
        """Factory settings: no reply, everything but the program as delivered."""
        if self.random.random() < 0.2:
            command = Instruction(137, value=1234)
            if self.book.locked:
                assert self.ask(command).status == 5
            else:
                self.ask(command, replies=0)
                self.book.forget()

    def spoil(self):
        """Another EEPROM magic: at the next power-on everything is as delivered."""
        if self.random.random() < 0.2 and not self.book.locked:
            assert self.do("SGP 64, 0, 17").status == 100
            self.cycle(spoilt=True)

    def cycle(self, *, spoilt=False):
        """Power off at any clock, and on; what is stored is what was stored."""
        self.world.set_power(False)
        self.received.clear()
        image = self.module.eeprom.to_bytes()
        if not spoilt:
            self.book.compare(Eeprom.from_bytes(image))
        self.run(self.random.choice((0, 1, 16_000, 16_000_000)))
        self.world.set_power(True)
        if spoilt:
            self.book.forget()
        self.book.compare(self.module.eeprom)
        self.received.clear()
        self.port.receive(pack_request(1, parse_instruction("GGP 66, 0")))
        self.run(256 * clock.MS)
        if [reply.value for reply in self.take_late() if reply.status == 100] != [1]:
            raise WedgedError("no answer after power-on")

    def compare_over_the_wire(self):
        """What the host reads is what it stored."""
        self.do("128")
        for number, value in self.book.settings.items():
            assert self.do(f"GGP {number}, 0").value == value, number
        for row in STORED:
            if self.model in row.models:
                for motor in range(3):
                    self.do(f"RSAP {row.number}, {motor}")
                    assert self.do(f"GAP {row.number}, {motor}").value == self.book.axes[motor][row.number]
        for number, value in enumerate(self.book.variables):
            assert self.do(f"RSGP {number}, 2").status == 100
            assert self.do(f"GGP {number}, 2").value == value


OPERATIONS = {
    "command": 40, "move": 30, "wait": 60, "noise": 5, "unknown": 3, "world_event": 20, "program": 8, "control": 6,
    "store_axis": 10, "store_global": 10, "lock": 4, "store_variable": 6, "store_coordinate": 6, "forget": 2,
    "spoil": 1, "cycle": 6, "rest": 2,
}  # fmt: skip
"""What a host and the world do, with weights."""


class Book:
    """What the host has stored, written down by itself."""

    def __init__(self, model):
        self.model = model
        self.program = [Instruction(0)] * PROGRAM_SIZE
        self.forget()

    def forget(self):
        self.axes = [
            {row.number: row.default for row in STORED if self.model in row.models} for _ in range(3)
        ]
        self.settings = {row.number: row.default for row in EEPROM_GLOBALS}
        self.variables = [0] * USER_VARIABLES
        self.coordinates = [dict.fromkeys(range(1, COORDINATES), 0) for _ in range(3)]

    @property
    def locked(self):
        return self.settings[73] == 1

    def compare(self, eeprom):
        """An EEPROM holds what is in the book."""
        assert eeprom.axis_values == self.axes
        assert eeprom.global_values == self.settings
        assert eeprom.variables == self.variables
        assert eeprom.coordinates == [list(each.values()) for each in self.coordinates]
        for address, instruction in enumerate(self.program):
            assert eeprom.read_instruction(address) == instruction


@pytest.mark.parametrize("model", MODELS)
def test_nothing_is_lost_or_wedges_and_neither_slices_nor_snapshots_matter(model):
    first = Soak(model, seed=model)
    digest = first.play(HOURS / len(MODELS))
    second = Soak(model, seed=model, slices=1)
    assert second.play(HOURS / len(MODELS)) == digest
    third = Soak(model, seed=model, snapshots=1)
    assert third.play(HOURS / len(MODELS)) == digest
    assert first.operations > 100
