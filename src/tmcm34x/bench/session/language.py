"""From the text of a session to its cases.  The lines are explained in docs/sessions.md."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Final

from tmcm34x.bench.session import actions
from tmcm34x.bench.session.actions import Action
from tmcm34x.bench.session.condition import Measured, read_condition, read_instruction
from tmcm34x.bench.session.errors import SessionSyntaxError
from tmcm34x.bench.session.phrase import NUMBER, LineError, check_span, read_byte, read_number, read_phrase
from tmcm34x.bench.session.player import CAN, SERIAL, Step
from tmcm34x.bench.session.world import EVENTS, MEASUREMENTS
from tmcm34x.clock import HZ, MS
from tmcm34x.files import read_text
from tmcm34x.toolchain.mending.spelling import proposal

MODELS: Final = frozenset({341, 342, 343})
KINDS: Final = {"memory": SERIAL, "pty": SERIAL, "tcp": SERIAL, "can": CAN, "slcan": CAN}
"""Links by name, with the kind of line that each is."""
UNITS: Final = {"clocks": 1, "us": MS // 1000, "ms": MS, "s": HZ, "min": 60 * HZ, "h": 3600 * HZ}
KEYWORDS: Final = ("within", "always", "never")
LONGEST: Final = 1 << 60
"""Clocks of the longest time that a line may name."""

_BYTE: Final = r'(?:"(?:[^"\\]|\\.)*"|[0-9A-Fa-f]{2})'
_BYTES: Final = re.compile(rf"{_BYTE}(?:\s+{_BYTE})*\Z")
_FRAME: Final = re.compile(rf"id\s+(\d+|\$[0-9A-Fa-f]+):\s*({_BYTE}(?:\s+{_BYTE})*)\Z")
_STATUS: Final = re.compile(rf"(\d+)(?:\s+({NUMBER}))?(?:\.\.({NUMBER}))?(?:\s+of\s+(\d+))?\Z")
_TIME: Final = re.compile(r"(\d+(?:\.\d+)?)\s*([a-zA-Z]+)\Z")
_ADDRESS: Final = re.compile(rf"({NUMBER})(?:\s+host\s+({NUMBER}))?\Z")
_ONLY: Final = re.compile(r"\s*\[((?:34[123]\s*)+)\]\Z")
_STAMP: Final = re.compile(r"(\d+\.\d+)\s+(?=[<>])")
_DIRECTIVE: Final = re.compile(r"#\s*(models|links|pins|bench)\s*:\s*(.*)\Z", re.IGNORECASE)
_KEYWORD: Final = re.compile(r"(?:(within)\s+([^:]*?)|(always|never))\s*:\s*")
_ESCAPES: Final = {"r": "\r", "n": "\n", "b": "\b", "\\": "\\", '"': '"'}


@dataclass
class Case:
    """The part of a session from one `==` line to the next: a conversation with a fresh module."""

    path: Path
    line: int
    title: str
    models: frozenset[int] = MODELS
    links: frozenset[str] = frozenset(KINDS)
    bench: str = ""
    """Text of a bench file; empty for bare motors."""
    pins: list[str] = field(default_factory=list[str])
    """Names of what the case pins, as they stand there."""
    steps: list[Step] = field(default_factory=list[Step])

    @property
    def kinds(self) -> frozenset[str]:
        """The kinds of lines that it is for: "serial", "can"."""
        return frozenset(KINDS[link] for link in self.links)

    def __str__(self) -> str:
        return f"{self.path.stem}:{self.line}"


def load(path: Path) -> list[Case]:
    """The cases of a session file.  Raises `SessionSyntaxError`."""
    try:
        return parse(read_text(path), path)
    except OSError as error:
        raise SessionSyntaxError(str(path), 0, 0, error.strerror or "cannot be read") from None
    except UnicodeDecodeError:
        raise SessionSyntaxError(str(path), 0, 0, "not a text file in UTF-8") from None


def parse(text: str, path: Path = Path("session")) -> list[Case]:
    """The cases in `text`, which is that of `path`.  Raises `SessionSyntaxError`."""
    head = Case(path, 0, "")
    case, cases = head, list[Case]()
    for number, line in enumerate(text.splitlines(), 1):
        try:
            if line.startswith("=="):
                case = Case(path, number, line[2:].strip(), head.models, head.links, head.bench)
                cases.append(case)
            else:
                _read_line(case, number, line.rstrip())
        except LineError as error:
            raise SessionSyntaxError(str(path), number, error.column + 1, error.problem) from None
    if head.steps or head.pins or not cases:
        first = head.steps[0].line if head.steps else 0
        raise SessionSyntaxError(str(path), first, 0, "steps and pins belong under a line == title")
    return cases


def _read_line(case: Case, number: int, line: str) -> None:
    if not line:
        return
    if line[0] == "#":
        _read_directive(case, line)
    elif line[0] == "|":
        case.bench += line[1:].removeprefix(" ") + "\n"
    else:
        models, text = case.models, line
        if match := _ONLY.search(line):
            models, text = frozenset(map(int, match.group(1).split())), line[: match.start()]
        at = None
        if match := _STAMP.match(text):
            at, text = round(float(match.group(1)) * HZ), " " * match.end() + text[match.end() :]
        case.steps.append(Step(number, line, _read_action(text), models, at))


def _read_action(line: str) -> Action:
    sign = len(line) - len(line.lstrip()) if line[0] == " " else 0
    reader = _READERS.get(line[sign : sign + 1])
    if reader is None:
        return _read_other(line)
    rest = line[sign + 1 :]
    start = sign + 1 + len(rest) - len(rest.lstrip())
    text = line[start:]
    try:
        return reader(text)
    except LineError as error:
        raise LineError(error.problem, start + error.column) from None


def _read_other(line: str) -> Action:
    try:
        return _read_keyword(line)
    except LineError as error:
        if error.column:
            raise
        raise LineError(f"expected a line with == # | {' '.join(_READERS)}, or {error.problem[9:]}") from None


def _read_keyword(line: str) -> actions.Within | actions.Promise:
    match = _KEYWORD.match(line)
    if match is None:
        word = re.split(r"[\s:]", line, maxsplit=1)[0]
        raise LineError(f"expected {', '.join(KEYWORDS)} and a colon, got {word}{proposal(word, KEYWORDS)}")
    within, time, other = match.groups()
    if within:
        clocks = _read_time(time, match.start(2))
        return actions.Within(clocks, read_condition(line, match.end()), line[match.end() :].strip())
    return actions.Promise(read_condition(line, match.end()), other == "always")


def read_expectation(text: str) -> actions.Within | actions.Promise:
    """The expectation in one line, `within 5 s: ...`, `always: ...` or `never: ...`.  Raises `LineError`."""
    return _read_keyword(text)


def _read_directive(case: Case, line: str) -> None:
    match = _DIRECTIVE.match(line)
    if match is None:
        return
    key, text = match.group(1).lower(), match.group(2)
    try:
        _DIRECTIVES[key](case, text)
    except LineError as error:
        raise LineError(error.problem, match.start(2) + error.column) from None


def _read_models(case: Case, text: str) -> None:
    words = frozenset(text.split())
    if not words or words - {str(model) for model in MODELS}:
        raise LineError(f"models are 341, 342 and 343, got {text}")
    case.models = frozenset(map(int, words))


def _read_links(case: Case, text: str) -> None:
    wanted = set(text.split())
    known = [*KINDS, *dict.fromkeys(KINDS.values())]
    for word in text.split():
        if word not in known:
            hint = proposal(word, known)
            raise LineError(f"links are serial, can, {', '.join(KINDS)}, got {word}{hint}", text.find(word))
    case.links = frozenset(link for link, kind in KINDS.items() if {link, kind} & wanted)
    if not case.links:
        raise LineError("expected a link")


def _read_bench(case: Case, text: str) -> None:
    try:
        case.bench = read_text(case.path.parent / text)
    except (OSError, UnicodeDecodeError) as error:
        raise LineError(f"{text}: {getattr(error, 'strerror', None) or 'not a text file'}") from None


def _read_pins(case: Case, text: str) -> None:
    case.pins += text.split()


_DIRECTIVES: Final[dict[str, Callable[[Case, str], None]]] = {
    "models": _read_models,
    "links": _read_links,
    "bench": _read_bench,
    "pins": _read_pins,
}


def _read_bytes(text: str) -> bytes:
    data = b""
    for token in re.findall(_BYTE, text):
        if token.startswith('"'):
            plain = re.sub(r"\\(.)", lambda match: _ESCAPES.get(match.group(1), match.group(0)), token[1:-1])
            data += plain.encode("latin-1", "replace")
        else:
            data += bytes.fromhex(token)
    return data


def _read_send(text: str) -> Action:
    if _BYTES.match(text):
        return actions.SendBytes(_read_bytes(text))
    if match := _FRAME.match(text):
        return actions.SendFrame(read_number(match.group(1)), _read_bytes(match.group(2)))
    return actions.Send(read_instruction(text))


def _read_expect(text: str) -> Action:
    if text == "-":
        return actions.Nothing()
    if _BYTES.match(text):
        return actions.Bytes(_read_bytes(text))
    if match := _FRAME.match(text):
        return actions.ExpectedFrame(read_number(match.group(1)), _read_bytes(match.group(2)))
    match = _STATUS.match(text)
    if match is None:
        raise LineError(f"expected -, bytes, or a status with a value or a range a..b, got {text}")
    status, low, high, command = match.groups()
    lowest = None if low is None else read_number(low)
    highest = read_number(high or low or "0")
    check_span(lowest, highest)
    answered = None if command is None else read_byte(command, "the number of a command")
    return actions.ExpectedReply(read_byte(status, "a status"), lowest, highest, answered)


def _read_time(text: str, start: int = 0) -> int:
    match = _TIME.match(text.strip())
    unit = match.group(2) if match else re.sub(r"[\d.\s]", "", text)
    if match is None or unit not in UNITS:
        hint = proposal(unit, UNITS, 1)
        raise LineError(f"expected a time in {', '.join(UNITS)}, got {text or 'nothing'}{hint}", start)
    clocks = float(match.group(1)) * UNITS[unit]
    if not isfinite(clocks) or clocks > LONGEST:
        raise LineError("expected a time of less than a thousand years", start)
    return round(clocks)


def _read_wait(text: str) -> Action:
    return actions.PassTime(_read_time(text))


def _read_event(text: str) -> Action:
    deeds, values = read_phrase(text, EVENTS)
    return actions.Happen(deeds(*values))


def _read_check(text: str) -> Action:
    return actions.Check(Measured(*read_phrase(text, MEASUREMENTS)), text.strip())


def _read_address(text: str) -> Action:
    match = _ADDRESS.match(text)
    if match is None:
        raise LineError(f"expected an address, or an address and host with an address, got {text}")
    module, host = match.groups()
    return actions.Address(read_number(module), None if host is None else read_number(host))


_READERS: Final[dict[str, Callable[[str], Action]]] = {
    ">": _read_send,
    "<": _read_expect,
    "+": _read_wait,
    "!": _read_event,
    "?": _read_check,
    "@": _read_address,
}
