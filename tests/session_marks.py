"""What a session really made a module do, for docs/conformance.md; and time in slices."""

import random
import re

import conformance

from tmcm34x.bench.session.player import Player
from tmcm34x.bench.session.runner import play as play_case
from tmcm34x.bench.session.wires import MemorySerial
from tmcm34x.tmcl.datagram import SIZE
from tmcm34x.tmcl.status import Status

NEVER_ANSWERED = {137, 205, 242}
BOOT_ANSWERS = {134, 136}


class MarkingPlayer(Player):
    """A player that keeps the replies, and the marks of all that the module was made to do."""

    def __init__(self, wire, path, title):
        super().__init__(wire, path, title)
        self.replies = []
        self.marks = set()

    def note_sent(self, data):
        if re.match(rb"[A-Z] ?[A-Za-z][A-Za-z0-9]+\b.*\r\Z", data):
            name = re.split(rb"[ ,\r]+", data[1:].strip())[0].decode().upper()
            self.marks.add(f"ASCII.{name}")

    def note_taken(self, data):
        self.replies.append(data)

    def note_frame(self, frame):
        self.replies.append(frame)
        self.marks.add(f"CAN.{len(frame.data)}")

    def note_bytes(self, data):
        if len(data) == SIZE or (self.asked and self.asked.number in BOOT_ANSWERS):
            self.note_reply(data[2])

    def note_reply(self, status):
        """A command that was only loaded was not carried out."""
        self.marks.add(f"STATUS.{status}")
        if self.asked is not None and status != Status.LOADED:
            self.marks.update(conformance.marks(self.asked))

    def note_silence(self):
        if self.asked and self.asked.number in NEVER_ANSWERED:
            self.marks.update(conformance.marks(self.asked))


class Watcher:
    """An observer of a module that notes what its program carries out."""

    def __init__(self, player):
        self.player = player

    def instruction(self, address, instruction, now):
        self.player.marks.update(conformance.marks(instruction))

    def telegram(self, *_):
        pass

    def event(self, *_):
        pass


def play(case, wire, model, *, watched=False):
    """Play `case` over `wire`; `watched` notes the commands of the program too."""
    player = MarkingPlayer(wire, str(case.path), case.title)
    if watched:
        wire.rig.modules[0].observers.append(Watcher(player))
    return play_case(case, wire, model, player)


def missing_marks(case, marks):
    """Pins of `case` that it did not really exercise."""
    rows = ((key, conformance.ROWS.get(key)) for pin in case.pins for key in conformance.expand(pin))
    return [key for key, row in rows if row is not None and not set(row.members) <= marks]


class SlicedSerial(MemorySerial):
    """A serial line in memory with time cut into pieces of any size."""

    def __init__(self, rig, seed):
        super().__init__(rig)
        self.random = random.Random(seed)

    def advance(self, clocks):
        until = self.rig.now + clocks
        for _ in range(self.random.randrange(8)):
            super().advance(self.random.randint(0, until - self.rig.now))
        super().advance(until - self.rig.now)
