"""Sessions: conversations with a module, as text that a user could have typed (docs/sessions.md).

`load` reads a file into cases, `play` plays one case over any wire.  A wire is an object with

    kind                    "serial" or "can"
    rig                     the bench with the module at the other end
    send(data)              bytes to a serial line;  send_frame(identifier, data) on CAN
    received                a bytearray of what came back and was not read yet; a list of frames on CAN
    advance(clocks)         simulated time passes
    settle()                what was sent has been heard and its answers, if any at this clock, have come back
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import conformance

from tmcm34x import clock
from tmcm34x.tmcl.datagram import (
    CAN_SIZES,
    SIZE,
    ChecksumError,
    Instruction,
    Reply,
    pack_can_request,
    pack_request,
    unpack_can_reply,
    unpack_can_request,
    unpack_reply,
    unpack_request,
)
from tmcm34x.tmcl.mnemonic import MnemonicError, parse_instruction
from tmcm34x.tmcl.status import Status

MODELS = frozenset({341, 342, 343})
LINKS = ("memory", "pty", "tcp", "can", "slcan")
KIND = {"memory": "serial", "pty": "serial", "tcp": "serial", "can": "can", "slcan": "can"}
UNITS = {
    "clocks": 1,
    "us": clock.MS // 1000,
    "ms": clock.MS,
    "s": clock.HZ,
    "min": 60 * clock.HZ,
    "h": 3600 * clock.HZ,
}

BYTE = r'(?:"(?:[^"\\]|\\.)*"|[0-9A-Fa-f]{2})'
BYTES = re.compile(rf"{BYTE}(?:\s+{BYTE})*\Z")
FRAME = re.compile(rf"id\s+(\d+|\$[0-9A-Fa-f]+):\s*({BYTE}(?:\s+{BYTE})*)\Z")
NUMBER = r"(?:-?\d+|\$[0-9A-Fa-f]+)"
STATUS = re.compile(rf"(\d+)(?:\s+({NUMBER}))?(?:\.\.({NUMBER}))?(?:\s+of\s+(\d+))?\Z")
TIME = re.compile(r"(\d+(?:\.\d+)?)\s*([a-z]+)\Z")
ADDRESS = re.compile(rf"({NUMBER})(?:\s+host\s+({NUMBER}))?\Z")
ONLY = re.compile(r"\s*\[((?:34[123]\s*)+)\]\Z")
DIRECTIVE = re.compile(r"#\s*(models|links|pins|bench)\s*:\s*(.*)\Z", re.IGNORECASE)
NEVER_ANSWERED = {137, 205, 242}
ESCAPES = {"r": "\r", "n": "\n", "b": "\b", "\\": "\\", '"': '"'}


class SessionError(Exception):
    """A session file that cannot be read, or a module that did not answer as the session says."""


class Bytes(NamedTuple):
    """Bytes on a serial line, sent or expected."""

    data: bytes


class Frame(NamedTuple):
    """A CAN frame, sent or expected."""

    identifier: int
    data: bytes


class Answer(NamedTuple):
    """An expected reply; the value is not looked at when `low` is None.

    `command` is the number of the command that it answers, when that is not the last one sent.
    """

    status: int
    low: int | None
    high: int | None
    command: int | None


class Nothing(NamedTuple):
    """No reply is waiting."""


class Wait(NamedTuple):
    """Simulated time."""

    clocks: int


class World(NamedTuple):
    """Something that happens to the module, or is seen on it."""

    act: Callable[..., None]
    arguments: tuple[str, ...]


class Address(NamedTuple):
    """Where the next telegrams go, and where replies must go."""

    module: int
    host: int | None


Action = Instruction | Bytes | Frame | Answer | Nothing | Wait | World | Address


class Step(NamedTuple):
    """One line of a session."""

    line: int
    sign: str
    text: str
    action: Action
    models: frozenset[int]


@dataclass
class Case:
    """The part of a session file from one `==` line to the next: a conversation with a fresh module."""

    path: Path
    line: int
    title: str
    models: frozenset[int]
    links: frozenset[str]
    bench: str = ""
    pins: list[str] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)

    def __str__(self) -> str:
        return f"{self.path.stem}:{self.line}"


# Reading


def load(path: Path) -> list[Case]:
    """The cases of a session file; raises `SessionError` with file and line."""
    lines = path.read_text().splitlines()
    head = Case(path, 0, "", MODELS, frozenset(LINKS))
    case, cases = head, []
    for number, line in enumerate(lines, 1):
        try:
            if line.startswith("=="):
                case = Case(path, number, line[2:].strip(), head.models, head.links, head.bench)
                cases.append(case)
            else:
                _read_line(case, number, line)
        except (SessionError, MnemonicError) as error:
            raise SessionError(f"{path}:{number}: {error}") from None
    if head.steps or head.pins or not cases:
        raise SessionError(f"{path}: steps and pins belong under a line == title")
    return cases


def _read_line(case: Case, number: int, line: str) -> None:
    line = line.rstrip()
    if not line:
        return
    if line[0] == "#":
        _read_directive(case, line)
    elif line[0] == "|":
        case.bench += line[1:].removeprefix(" ") + "\n"
    elif line[0] in READERS:
        sign, text = line[0], line[1:].strip()
        models = case.models
        if match := ONLY.search(text):
            models, text = frozenset(map(int, match.group(1).split())), text[: match.start()]
        case.steps.append(Step(number, sign, text, READERS[sign](text), models))
    else:
        raise SessionError(f"a line starts with one of == # | {' '.join(READERS)}: {line}")


def _read_directive(case: Case, line: str) -> None:
    match = DIRECTIVE.match(line)
    if match is None:
        return
    key, text = match.group(1).lower(), match.group(2)
    if key == "models":
        case.models = frozenset(map(int, text.split()))
        if not case.models or case.models - MODELS:
            raise SessionError(f"models are 341, 342 and 343: {text}")
    elif key == "links":
        wanted = set(text.split())
        case.links = frozenset(link for link in LINKS if {link, KIND[link]} & wanted)
        if not case.links or wanted - set(LINKS) - set(KIND.values()):
            raise SessionError(f"links are serial, can, {', '.join(LINKS)}: {text}")
    elif key == "bench":
        case.bench = (case.path.parent / text).read_text()
    else:
        case.pins += conformance.expand(text)


def _read_number(text: str) -> int:
    return int(text[1:], 16) if text.startswith("$") else int(text)


def _read_bytes(text: str) -> bytes:
    data = b""
    for token in re.findall(BYTE, text):
        if token.startswith('"'):
            plain = re.sub(r"\\(.)", lambda match: ESCAPES.get(match.group(1), match.group(0)), token[1:-1])
            data += plain.encode("latin-1")
        else:
            data += bytes.fromhex(token)
    return data


def _read_frame(text: str) -> Frame | None:
    match = FRAME.match(text)
    return Frame(_read_number(match.group(1)), _read_bytes(match.group(2))) if match else None


def _read_send(text: str) -> Action:
    if BYTES.match(text):
        return Bytes(_read_bytes(text))
    return _read_frame(text) or parse_instruction(text)


def _read_expect(text: str) -> Action:
    if text == "-":
        return Nothing()
    if BYTES.match(text):
        return Bytes(_read_bytes(text))
    if frame := _read_frame(text):
        return frame
    match = STATUS.match(text)
    if match is None:
        raise SessionError(f"expected -, bytes, or a status with a value or a range a..b: {text}")
    status, low, high, command = match.groups()
    lowest = None if low is None else _read_number(low)
    highest = lowest if high is None else _read_number(high)
    return Answer(int(status), lowest, highest, None if command is None else int(command))


def _read_wait(text: str) -> Action:
    match = TIME.match(text)
    if match is None or match.group(2) not in UNITS:
        raise SessionError(f"expected a time in {', '.join(UNITS)}: {text}")
    return Wait(round(float(match.group(1)) * UNITS[match.group(2)]))


def _read_address(text: str) -> Action:
    match = ADDRESS.match(text)
    if match is None:
        raise SessionError(f"expected an address, or an address and host with an address: {text}")
    module, host = match.groups()
    return Address(_read_number(module), None if host is None else _read_number(host))


def _read_world(table: tuple[tuple[str, Callable[..., None]], ...], what: str) -> Callable[[str], Action]:
    def read(text: str) -> Action:
        for pattern, act in table:
            if match := re.fullmatch(pattern, text):
                return World(act, match.groups())
        raise SessionError(f"unknown {what}: {text}")

    return read


# The world: what happens to a module (`!`) and what can be measured on it (`?`)


class Echo:
    """An SPI device that answers a telegram with what it received in the one before."""

    def __init__(self) -> None:
        self.last = 0

    def exchange(self, data: int, nbytes: int) -> int:
        """Take `nbytes` bytes, give back those of last time."""
        answer, self.last = self.last, data
        return answer & ((1 << 8 * nbytes) - 1)


class Constant:
    """An SPI device that always answers the same."""

    def __init__(self, value: int) -> None:
        self.value = value

    def exchange(self, data: int, nbytes: int) -> int:
        """Take anything, give back the value."""
        return self.value & ((1 << 8 * nbytes) - 1)


def _power(rig: Any, what: str) -> None:
    world = rig.worlds[0]
    if what in {"off", "cycle"}:
        world.set_power(False)
    if what in {"on", "cycle"}:
        world.set_power(True)


SHUTDOWN = 8
HIGH = 1023

EVENTS: tuple[tuple[str, Callable[..., None]], ...] = (
    (r"power (off|on|cycle)", _power),
    (
        r"motor ([012]) (left|right) switch (closes|opens)",
        lambda rig, motor, side, what: rig.worlds[0].set_switch(int(motor), side, what == "closes"),
    ),
    (
        r"motor ([012]) fault (\w+) (begins|ends)",
        lambda rig, motor, name, what: rig.worlds[0].set_fault(int(motor), name, what == "begins"),
    ),
    (
        r"motor ([012]) moved to (-?[\d.]+)",
        lambda rig, motor, position: rig.worlds[0].move(int(motor), float(position)),
    ),
    (
        r"input ([0-7]) (high|low)",
        lambda rig, n, level: rig.worlds[0].set_level(int(n), HIGH * (level == "high")),
    ),
    (r"analog ([0-7]) (\d+)", lambda rig, n, value: rig.worlds[0].set_level(int(n), int(value))),
    (
        r"shutdown pin (high|low)",
        lambda rig, level: rig.worlds[0].set_level(SHUTDOWN, HIGH * (level == "high")),
    ),
    (r"spi ([012]) echo", lambda rig, select: rig.modules[0].board.attach_spi(int(select), Echo())),
    (
        r"spi ([012]) constant (\d+)",
        lambda rig, select, value: rig.modules[0].board.attach_spi(int(select), Constant(int(value))),
    ),
)


def _see(what: object, wanted: object) -> None:
    if what != wanted:
        raise SessionError(f"it is {what}")


def _see_load(rig: Any, motor: str, low: str, high: str | None) -> None:
    position = rig.worlds[0].view()[int(motor)].position
    if not float(low) - TOLERANCE <= position <= float(high or low) + TOLERANCE:
        raise SessionError(f"it is at {position:.3f}")


def _driver_word(rig: Any, motor: str) -> int:
    """The word of 12 bits that the motion chip sends to a driver."""
    bits, _ = rig.modules[0].board.chips[0].driver_datagram()
    return bits >> 12 * (2 - int(motor)) & 0xFFF


TOLERANCE = 0.02

MEASUREMENTS: tuple[tuple[str, Callable[..., None]], ...] = (
    (r"outputs ([01]{8})", lambda rig, bits: _see(f"{rig.modules[0].board.outputs:08b}", bits)),
    (
        r"motor ([012]) current (\d+)",
        lambda rig, motor, current: _see(rig.modules[0].board.currents[int(motor)], int(current)),
    ),
    (
        r"motor ([012]) driver (on|off)",
        lambda rig, motor, state: _see(rig.modules[0].board.enabled[int(motor)], state == "on"),
    ),
    (
        r"motor ([012]) mixed decay in ([012]) bridges",
        lambda rig, motor, bridges: _see((_driver_word(rig, motor) & 0x820).bit_count(), int(bridges)),
    ),
    (
        r"motor ([012]) in (full|micro) steps",
        lambda rig, motor, kind: _see((_driver_word(rig, motor) & 0x3DE) == 0x3DE, kind == "full"),
    ),
    (r"motor ([012]) load at (-?[\d.]+?)(?:\.\.(-?[\d.]+))?", _see_load),
)

READERS: dict[str, Callable[[str], Action]] = {
    ">": _read_send,
    "<": _read_expect,
    "+": _read_wait,
    "!": _read_world(EVENTS, "event"),
    "?": _read_world(MEASUREMENTS, "measurement"),
    "@": _read_address,
}


# Playing


@dataclass
class Player:
    """One conversation under way."""

    wire: Any
    address: int = 1
    host: int = 2
    asked: Instruction | None = None
    replies: list[bytes | Frame] = field(default_factory=list)
    marks: set[str] = field(default_factory=set)

    def play(self, step: Step) -> None:
        """Do one line; raises `SessionError` when the module does not do as it says."""
        self.wire.settle()
        if step.sign in ">+!" and self.wire.received:
            raise SessionError(f"not read yet: {self._waiting()}")
        match step.action:
            case Instruction() as instruction:
                self._send(instruction)
            case Bytes(data) if step.sign == ">":
                self._send_bytes(data)
            case Frame(identifier, data) if step.sign == ">":
                self._send_frame(identifier, data)
            case Wait(clocks):
                self.wire.advance(clocks)
            case World(act, arguments):
                act(self.wire.rig, *arguments)
                self.wire.advance(0)
            case Address(module, host):
                self.address, self.host = module, self.host if host is None else host
            case Answer() as answer:
                self._expect(answer)
            case Nothing():
                self.finish()
                if self.asked and self.asked.number in NEVER_ANSWERED:
                    self.marks.update(conformance.marks(self.asked))
            case Bytes(data):
                self._expect_bytes(data)
            case Frame() as frame:
                self._expect_frame(frame)

    def finish(self) -> None:
        """Nothing may be waiting."""
        self.wire.settle()
        if self.wire.received:
            raise SessionError(f"expected no reply, got {self._waiting()}")

    def _send(self, instruction: Instruction) -> None:
        self.asked = instruction
        if self.wire.kind == "can":
            self.wire.send_frame(self.address, pack_can_request(instruction))
        else:
            self.wire.send(pack_request(self.address, instruction))

    def _send_bytes(self, data: bytes) -> None:
        try:
            self.asked = unpack_request(data)[1]
        except (ValueError, ChecksumError):
            self.asked = None
        if re.match(rb"[A-Z] ?[A-Za-z][A-Za-z0-9]+\b.*\r\Z", data):
            name = re.split(rb"[ ,\r]+", data[1:].strip())[0].decode().upper()
            self.marks.add(f"ASCII.{name}")
        self.wire.send(data)

    def _send_frame(self, identifier: int, data: bytes) -> None:
        self.asked = unpack_can_request(data) if len(data) in CAN_SIZES else None
        self.wire.send_frame(identifier, data)

    def _expect(self, answer: Answer) -> None:
        reply = self._reply()
        number = answer.command or (self.asked.number if self.asked else reply.command)
        wanted = Reply(self.host, self.address, answer.status, number, reply.value)
        if reply != wanted or (
            answer.low is not None and not answer.low <= reply.value <= (answer.high or 0)
        ):
            raise SessionError(f"got {reply}")
        self._mark(reply.status)

    def _mark(self, status: int) -> None:
        """Note what was done; a command that was only loaded was not."""
        self.marks.add(f"STATUS.{status}")
        if self.asked is not None and status != Status.LOADED:
            self.marks.update(conformance.marks(self.asked))

    def _reply(self) -> Reply:
        if self.wire.kind == "can":
            identifier, data = self._take_frame()
            return unpack_can_reply(data)._replace(host=identifier)
        try:
            return unpack_reply(self._take(SIZE))
        except ChecksumError as error:
            raise SessionError(f"got a reply with {error}") from None

    def _expect_bytes(self, data: bytes) -> None:
        got = self._take(len(data))
        if got != data:
            raise SessionError(f"got {got.hex(' ')} {got!r}")
        if len(data) == SIZE or (self.asked and self.asked.number in {134, 136}):
            self._mark(data[2])

    def _expect_frame(self, frame: Frame) -> None:
        got = self._take_frame()
        if got != frame:
            raise SessionError(f"got id {got.identifier}: {got.data.hex(' ')} {got.data!r}")
        self._mark(got.data[1])

    def _take_frame(self) -> Frame:
        if not self.wire.received:
            raise SessionError("got no frame")
        frame = Frame(*self.wire.received.pop(0))
        self.replies.append(frame)
        self.marks.add(f"CAN.{len(frame.data)}")
        return frame

    def _take(self, size: int) -> bytes:
        data = bytes(self.wire.received[:size])
        if len(data) < size:
            raise SessionError(f"got {data.hex(' ') or 'nothing'}")
        del self.wire.received[:size]
        self.replies.append(data)
        return data

    def _waiting(self) -> str:
        if self.wire.kind == "can":
            return ", ".join(f"id {identifier}: {data.hex(' ')}" for identifier, data in self.wire.received)
        return bytes(self.wire.received).hex(" ")


class Watcher:
    """An observer of a module that notes what its program carries out."""

    def __init__(self, player: Player) -> None:
        self.player = player

    def instruction(self, address: int, instruction: Instruction, now: int) -> None:
        """The program is about to carry out `instruction`."""
        self.player.marks.update(conformance.marks(instruction))

    def telegram(self, *_: Any) -> None:
        """Bytes came or went."""

    def event(self, *_: Any) -> None:
        """Something happened to a motor."""


# Wires in memory


class MemorySerial:
    """A serial line without a link: the port of a module, in virtual time."""

    kind = "serial"

    def __init__(self, rig: Any) -> None:
        self.rig = rig
        self.received = bytearray()
        self.send = rig.modules[0].open_serial_port(self.received.extend).receive

    def advance(self, clocks: int) -> None:
        """Let simulated time pass."""
        clock.run_until(self.rig, self.rig.now + clocks)

    def settle(self) -> None:
        """All has happened already."""


class SlicedSerial(MemorySerial):
    """A serial line in memory with time cut into pieces of any size."""

    def __init__(self, rig: Any, seed: int) -> None:
        super().__init__(rig)
        self.random = random.Random(seed)

    def advance(self, clocks: int) -> None:
        """Let simulated time pass, with stops where nothing happens."""
        until = self.rig.now + clocks
        for _ in range(self.random.randrange(8)):
            super().advance(self.random.randint(0, until - self.rig.now))
        super().advance(until - self.rig.now)


class MemoryCan(MemorySerial):
    """A CAN bus without a link."""

    kind = "can"

    def __init__(self, rig: Any) -> None:
        self.rig = rig
        self.received: list[tuple[int, bytes]] = []
        port = rig.modules[0].open_can_port(
            lambda identifier, data: self.received.append((identifier, bytes(data)))
        )
        self.send_frame = port.receive


def play(case: Case, wire: Any, model: int, *, watched: bool = False) -> Player:
    """Play `case` over `wire`; the player knows the replies, and the marks of all that the module was made to do.

    watched: whether an observer notes the commands of the program too
    Raises `SessionError` that names the line.
    """
    player = Player(wire)
    if watched:
        wire.rig.modules[0].observer = Watcher(player)
    for step in case.steps:
        if model in step.models:
            try:
                player.play(step)
            except SessionError as error:
                raise SessionError(
                    f"{case.path.name}:{step.line}: {step.sign} {step.text}: {error}"
                ) from None
    try:
        player.finish()
    except SessionError as error:
        raise SessionError(f"{case.path.name}, end of {case.title}: {error}") from None
    return player


def missing_marks(case: Case, marks: set[str]) -> list[str]:
    """Pins of `case` that it did not really exercise."""
    rows = ((key, conformance.ROWS.get(key)) for key in case.pins)
    return [key for key, row in rows if row is not None and not set(row.members) <= marks]


def all_cases(folder: Path) -> Iterator[Case]:
    """The cases of all session files in `folder`."""
    for path in sorted(folder.glob("*.txt")):
        yield from load(path)
