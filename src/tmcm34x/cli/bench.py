"""`tmcm34x bench`: control of a module that is being served, through `--control` of `serve` or `ide`."""

from __future__ import annotations

import base64
import json
import socket
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click

from tmcm34x.cli import CliError, outputs
from tmcm34x.cli.link_options import LOOPBACK
from tmcm34x.files import read_bytes

Request = dict[str, Any]


@dataclass(frozen=True)
class Word:
    """One thing to do: its operands as the help shows them, and the request that they make."""

    operands: str
    help: str
    request: Callable[[Sequence[str]], Request]


def _act(action: str, *operands: Any) -> Request:
    return {"do": "act", "action": action, "operands": list(operands)}


def _off(words: Sequence[str]) -> bool:
    """Whether the word after the needed ones is `off`; anything else than on and off is a mistake."""
    if words and words[0] not in {"on", "off"}:
        raise ValueError(words[0])
    return list(words[:1]) == ["off"]


def _seconds(words: Sequence[str]) -> Request:
    number, unit = words[0], words[1] if len(words) > 1 else "s"
    return {"do": "until", "seconds": float(number) * {"s": 1.0, "ms": 0.001, "min": 60.0}[unit]}


def _level(words: Sequence[str]) -> Request:
    return _act("level", int(words[0]), None if words[1] == "auto" else int(words[1]))


WORDS: Final[dict[str, Word]] = {
    "press": Word("SIDE MOTOR", "close a limit switch", lambda w: _act("switch", int(w[1]), w[0], True)),
    "release": Word("SIDE MOTOR", "open a limit switch", lambda w: _act("switch", int(w[1]), w[0], False)),
    "free": Word(
        "SIDE MOTOR",
        "make a limit switch follow the load again",
        lambda w: _act("switch", int(w[1]), w[0], None),
    ),
    "unplug": Word(
        "SIDE MOTOR [off]",
        "break the cable of a limit switch, or mend it",
        lambda w: _act("unplug", int(w[1]), w[0], not _off(w[2:])),
    ),
    "level": Word("INPUT LEVEL|auto", "hold an input at 0..1023, or give it back to its source", _level),
    "driver": Word(
        "MOTOR FAULT [off]",
        "raise or end a fault of a driver",
        lambda w: _act("fault", int(w[0]), w[1], not _off(w[2:])),
    ),
    "push": Word(
        "MOTOR TORQUE", "load a shaft, in newton metres", lambda w: _act("push", int(w[0]), float(w[1]))
    ),
    "move": Word(
        "MOTOR POSITION",
        "take a load to a position, in mm or degrees",
        lambda w: _act("move", int(w[0]), float(w[1])),
    ),
    "power": Word("on|off", "switch the supply", lambda w: _act("power", not _off(w))),
    "fault": Word(
        "FAULT",
        "put a fault of the lines in force (docs/faults.md)",
        lambda w: {"do": "fault", "fault": w[0]},
    ),
    "clear": Word(
        "[NAME]",
        "end one fault of the lines, or all",
        lambda w: {"do": "clear", **({"fault": w[0]} if w else {})},
    ),
    "speed": Word(
        "FACTOR",
        "set the speed of virtual time; 1 is real time",
        lambda w: {"do": "speed", "speed": float(w[0])},
    ),
    "pause": Word("", "stop virtual time", lambda _: {"do": "pause"}),
    "resume": Word("", "resume virtual time", lambda _: {"do": "resume"}),
    "until": Word("TIME [s|ms|min]", "run virtual time for so long, as fast as possible", _seconds),
    "snapshot": Word("FILE", "write the state of the bench", lambda _: {"do": "snapshot"}),
    "restore": Word("FILE", "go back to a snapshot", lambda w: {"do": "restore", "snapshot": _read(w[0])}),
    "digest": Word("", "print the fingerprint of the state", lambda _: {"do": "digest"}),
    "state": Word("", "print what can be seen of the modules", lambda _: {"do": "state"}),
    "counters": Word("", "print what has been counted", lambda _: {"do": "counters"}),
}
"""What can be done, by its word."""

_LONGEST: Final = max(len(f"{name} {word.operands}") for name, word in WORDS.items())
_EPILOG: Final = "\b\nACTION is one of\n" + "\n".join(
    f"  {f'{name} {word.operands}':<{_LONGEST}}  {word.help}" for name, word in WORDS.items()
)


@click.command(epilog=_EPILOG, context_settings={"ignore_unknown_options": True})
@click.option(
    "--control",
    required=True,
    envvar="TMCM34X_CONTROL",
    metavar="ADDRESS",
    help="Where `serve` or `ide` listens with --control; also from the environment variable TMCM34X_CONTROL.",
)
@click.option("--module", type=click.IntRange(0), default=0, show_default=True, help="Index of the module.")
@click.argument("action")
@click.argument("operands", nargs=-1)
def command(control: str, module: int, action: str, operands: tuple[str, ...]) -> int:
    """Do something to the bench of a running `tmcm34x serve --control ADDRESS` or `tmcm34x ide --control ADDRESS`."""
    word = WORDS.get(action)
    if word is None:
        raise click.UsageError(f"there is no action {action!r}; there are {', '.join(WORDS)}")
    request = _request(action, word, operands)
    if request["do"] == "act":
        request["module"] = module
    answer = ask(control, request)
    if action == "snapshot":
        _write(operands[0], answer.pop("snapshot"))
    answer.pop("ok")
    if answer:
        click.echo(json.dumps(answer, indent=2) if len(answer) > 1 else next(iter(answer.values())))
    return 0


def _request(action: str, word: Word, operands: Sequence[str]) -> Request:
    least = sum(not each.startswith("[") for each in word.operands.split())
    usage = f"expected {action} {word.operands}".rstrip()
    if not least <= len(operands) <= len(word.operands.split()):
        raise click.UsageError(usage)
    try:
        return word.request(operands)
    except (ValueError, KeyError):
        raise click.UsageError(usage) from None


def ask(control: str, request: Request) -> Request:
    """Send a request to a control socket and wait for its answer; raises `CliError`."""
    try:
        with _connect(control) as connection, connection.makefile("rwb") as stream:
            stream.write(json.dumps(request).encode() + b"\n")
            stream.flush()
            line = stream.readline()
    except OSError as error:
        raise CliError(f"cannot reach {control}: {error.strerror or error}") from error
    if not line:
        raise CliError(f"{control} has hung up: is it a control socket?")
    try:
        answer = json.loads(line)
        refused = answer.get("error")
    except (ValueError, AttributeError):
        raise CliError(f"{control} is no control socket") from None
    if refused is not None:
        raise CliError(refused)
    return answer


def _connect(control: str) -> socket.socket:
    host, _, port = control.rpartition(":")
    if port.isdecimal() and "/" not in control:
        return socket.create_connection((host.strip("[]") or LOOPBACK, int(port)))
    if sys.platform == "win32":
        raise CliError(f"{control}: expected [HOST:]PORT")
    connection = socket.socket(socket.AF_UNIX)
    try:
        connection.connect(control)
    except OSError:
        connection.close()
        raise
    return connection


def _read(path: str) -> str:
    try:
        return base64.b64encode(read_bytes(Path(path))).decode()
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from error


def _write(path: str, text: str) -> None:
    outputs.write(Path(path), base64.b64decode(text))
