"""A rig goes on from a snapshot like the one that it was taken of, byte for byte."""

import copy
import pickle
import random
from functools import partial
from pathlib import Path

import pytest

from tmcm34x.bench import load, simple_rig
from tmcm34x.bench.action import Action
from tmcm34x.bench.snapshot import SnapshotError, pack_snapshot
from tmcm34x.clock import HZ, MS, run_until
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl.datagram import pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import assemble

BENCHES = sorted((Path(__file__).parents[2] / "examples" / "benches").glob("*.toml"))
BUILDERS = {
    **{f"{number}": partial(simple_rig, number) for number in (341, 342, 343)},
    **{path.stem: partial(load, path) for path in BENCHES},
}
PROGRAM = """\
Loop:   MVP   REL, 0, 3000
        WAIT  POS, 0, 100
        AGP   3, 2
        CALC  ADD, 1
        SIO   1, 2, 1
        WAIT  TICKS, 0, 7
        GGP   133, 0
        JA    Loop
"""
COMMANDS = (
    "MVP ABS, 0, 4000", "MVP ABS, 1, -9000", "MVP REL, 2, 700", "ROR 1, 900", "ROL 2, 300", "MST 1", "RFS START, 0",
    "RFS STOP, 0", "GAP 1, 0", "GAP 206, 1", "GAP 8, 2", "GGP 133, 0", "SAP 5, 0, 200", "SAP 140, 1, 4",
    "STAP 5, 0", "SGP 2, 2, 77", "STGP 2, 2", "SCO 3, 0, 1234", "GCO 3, 0", "SIO 3, 2, 1", "GIO 0, 1", "SAP 205, 0, 5",
    "MVP COORD, 0, 3",
)  # fmt: skip


class Activity:
    """A seeded course of commands, partial telegrams, actions and time on a rig, and what it answered."""

    def __init__(self, rig, seed):
        self.rig = rig
        self.random = random.Random(seed)
        self.replies = []
        self.ports = [SerialPort(module, self.replies.append) for module in rig.modules]

    def begin(self):
        module = self.rig.modules[0]
        module.eeprom.write_program(assemble(PROGRAM).program)
        self.send(parse_instruction("129 0, 0, 0"))

    def send(self, instruction, size=9):
        module = self.random.randrange(len(self.ports))
        telegram = pack_request(self.rig.modules[module].address, instruction)
        self.ports[module].receive(telegram[:size])

    def act(self):
        motor, on = self.random.randrange(3), self.random.random() < 0.5
        drivers = self.rig.modules[0].board.model.drivers is not None
        actions = [
            Action("switch", 0, (motor, "left", on or None)),
            Action("level", 0, (motor, 600 if on else None)),
            Action("push", 0, (motor, 0.01 * on)),
        ]
        if drivers:
            actions.append(Action("fault", 0, (motor, "open_load_a", on)))
        self.rig.act(self.random.choice(actions))

    def step(self):
        chance = self.random.random()
        if chance < 0.5:
            self.send(parse_instruction(self.random.choice(COMMANDS)))
        elif chance < 0.6:
            self.send(parse_instruction(self.random.choice(COMMANDS)), size=self.random.randrange(1, 9))
        elif chance < 0.75:
            self.act()
        run_until(self.rig, self.rig.now + self.random.randrange(1, 200 * MS))


def continued(activity, build):
    """The same activity from here on, on a rig that was built anew."""
    other = Activity(build(), 0)
    other.rig.restore(activity.rig.snapshot())
    other.random.setstate(activity.random.getstate())
    return other


def alike(one, other, steps):
    del one.replies[:], other.replies[:]
    for _ in range(steps):
        one.step()
        other.step()
        assert one.replies == other.replies
        assert one.rig.digest() == other.rig.digest()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", BUILDERS)
def test_a_fresh_rig_goes_on_from_a_snapshot(name, seed):
    activity = Activity(BUILDERS[name](), seed)
    activity.begin()
    for _ in range(4):
        for _ in range(8):
            activity.step()
        other = continued(activity, BUILDERS[name])
        assert other.rig.digest() == activity.rig.digest()
        alike(activity, other, 8)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda rig: pickle.loads(pickle.dumps(rig))])
@pytest.mark.parametrize("name", BUILDERS)
def test_a_copied_rig_is_independent(name, copied):
    activity = Activity(BUILDERS[name](), 1)
    activity.begin()
    for _ in range(6):
        activity.step()
    for module, port in zip(activity.rig.modules, activity.ports, strict=True):
        module.detach(port)
    rig = activity.rig
    before = rig.digest()
    other = copied(rig)
    assert other.digest() == before
    other.modules[0].execute(parse_instruction("ROR 0, 500"))
    run_until(other, other.now + HZ)
    assert rig.digest() == before
    assert other.digest() != before


def test_a_download_half_done_goes_on():
    activity = Activity(simple_rig(), 0)
    activity.send(parse_instruction("132 0, 0, 5"))
    activity.send(parse_instruction("ROR 0, 1"))
    other = continued(activity, simple_rig)
    for each in (activity, other):
        each.send(parse_instruction("ROR 0, 2"))
        each.send(parse_instruction("133 0, 0, 0"))
    assert other.rig.digest() == activity.rig.digest()
    assert other.rig.modules[0].eeprom.read_instruction(6) == parse_instruction("ROR 0, 2")


def changed(data, at, by):
    return data[:at] + by + data[at + len(by) :]


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (lambda data: b"", "not a snapshot of a bench"),
        (lambda data: changed(data, 0, b"X"), "not a snapshot of a bench"),
        (lambda data: changed(data, 4, b"\x63\0"), "format 99"),
        (lambda data: data[: len(data) // 2], "damaged"),
        (lambda data: data + b" ", "damaged"),
        (lambda data: pack_snapshot((1, 2), data[6:22]), "damaged"),
        (lambda data: data[:38] + data[38:].replace(b"1", b"2", 1), "damaged"),
    ],
)
def test_what_is_no_snapshot_of_this_bench_is_refused_and_changes_nothing(damage, text):
    rig = simple_rig()
    rig.modules[0].execute(parse_instruction("ROR 0, 500"))
    run_until(rig, HZ)
    before = rig.digest()
    with pytest.raises(SnapshotError, match=text):
        rig.restore(damage(rig.snapshot()))
    assert rig.digest() == before


def test_every_length_and_every_changed_byte_is_refused():
    rig, other = simple_rig(), simple_rig()
    run_until(rig, HZ)
    data, before = rig.snapshot(), other.digest()
    rng = random.Random(1)
    places = [*range(60), *(rng.randrange(len(data)) for _ in range(300))]
    for place in places:
        damaged = changed(data, place, bytes([data[place] ^ 1 << rng.randrange(8)]))
        for bad in (damaged, data[:place]):
            with pytest.raises(SnapshotError) as caught:
                other.restore(bad)
            assert "\n" not in str(caught.value)
    assert other.digest() == before


def test_a_snapshot_of_another_bench_is_refused():
    with pytest.raises(SnapshotError, match="another bench"):
        simple_rig(341).restore(simple_rig(343).snapshot())


def test_a_snapshot_of_a_busy_rig_is_small():
    activity = Activity(load(BENCHES[-1]), 5)
    activity.begin()
    for _ in range(20):
        activity.step()
    assert len(activity.rig.snapshot()) < 64 * 1024
