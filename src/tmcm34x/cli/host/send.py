"""`tmcm34x send`: direct mode."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.host.common import (
    FILE,
    NO_REPLY,
    REFUSED,
    confirm,
    json_option,
    opened,
    port_option,
    print_json,
    read_text,
    show_retries,
    yes_option,
)

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection
    from tmcm34x.host.exceptions import HostError
    from tmcm34x.tmcl.datagram import Instruction

_EXAMPLES = """\b
Examples:
  tmcm34x send "GAP actual_position, 0"
  tmcm34x send "SAP max_speed, 1, 500" "GAP 4, 1"
  tmcm34x send --file setup.txt --yes
"""


@click.command(epilog=_EXAMPLES)
@click.argument("lines", nargs=-1, metavar="[COMMAND]...")
@click.option("--file", type=FILE, metavar="FILE", help="Take the commands from a file, one a line.")
@click.option("--hex", "as_hex", is_flag=True, help="Show the bytes of requests and replies too.")
@port_option
@json_option
@yes_option
def command(
    *, lines: tuple[str, ...], file: Path | None, as_hex: bool, url: str | None, as_json: bool, yes: bool
) -> int:
    """Send each COMMAND and show the reply; without one, the lines of standard input.

    Names of parameters stand for their numbers. After a refusal the other commands are still sent, and the exit status
    is 4; without a reply it is 3 and the rest is not sent. A module found in download mode stores a command instead of
    executing it: the rest is not sent, and the exit status is 4; `tmcm34x stop` ends download mode.
    """
    instructions = _parse(lines or _lines(file))
    with opened(url) as connection:
        _ask(connection, instructions, yes)
        results, failure = _send_all(connection, instructions, as_hex, as_json)
        if as_json:
            print_json(results)
        else:
            show_retries(connection)
        if failure is not None:
            raise failure
    return max((result["exit"] for result in results), default=0)


def _lines(file: Path | None) -> Sequence[str]:
    if file is None and sys.stdin.isatty():
        raise click.UsageError("name a command, a --file, or give lines on standard input")
    text = sys.stdin.read() if file is None else read_text(file)
    return [line for line in text.splitlines() if line.split("//")[0].strip()]


def _parse(lines: Sequence[str]) -> list[Instruction]:
    from tmcm34x.host.direct import parse_line
    from tmcm34x.tmcl.mnemonic import MnemonicError

    instructions: list[Instruction] = []
    for number, line in enumerate(lines, 1):
        try:
            instructions.append(parse_line(line))
        except MnemonicError as error:
            raise CliError(f"command {number}, {line!r}: {error}") from error
    return instructions


def _ask(connection: Connection, instructions: Sequence[Instruction], yes: bool) -> None:
    from tmcm34x.host.effects import warning
    from tmcm34x.tmcl.mnemonic import format_instruction

    acting = [(instruction, text) for instruction in instructions if (text := warning(instruction))]
    if acting:
        what = "; ".join(f"{format_instruction(instruction)}: {text}" for instruction, text in acting[:3])
        confirm(connection, f"{what}{'; ...' if len(acting) > 3 else ''}", yes)


def _send_all(
    connection: Connection, instructions: Sequence[Instruction], as_hex: bool, as_json: bool
) -> tuple[list[dict[str, Any]], HostError | None]:
    """What each command gave, up to the first without a reply or to a module found in download mode, and why."""
    from tmcm34x.host.exceptions import DownloadModeError, HostError

    results: list[dict[str, Any]] = []
    loading = False
    for instruction in instructions:
        result = _row(connection, instruction)
        results.append(result)
        try:
            result |= _send(connection, instruction, loading)
        except HostError as error:
            left = len(instructions) - len(results)
            error.args = (f"{error}{f'; {left} more not sent' if left else ''}",)
            result |= {
                "exit": REFUSED if isinstance(error, DownloadModeError) else NO_REPLY,
                "error": str(error),
            }
            return results, error
        loading = _loads(instruction, loading)
        if not as_json:
            _show(result, as_hex)
    return results, None


def _loads(instruction: Instruction, loading: bool) -> bool:
    """Whether the module stores commands because this very host has asked it to."""
    from tmcm34x.host.steps import QUIT_DOWNLOAD, START_DOWNLOAD

    return {START_DOWNLOAD: True, QUIT_DOWNLOAD: False}.get(instruction.number, loading)


def _row(connection: Connection, instruction: Instruction) -> dict[str, Any]:
    """A command before it is sent."""
    from tmcm34x.tmcl.datagram import pack_request
    from tmcm34x.tmcl.mnemonic import format_instruction

    sent = pack_request(connection.address, instruction).hex(" ")
    text = format_instruction(instruction)
    return {"command": text, "sent": sent, "received": None, "status": None, "value": None}


def _send(connection: Connection, instruction: Instruction, loading: bool) -> dict[str, Any]:
    """What a command gave.  Raises `HostError` without a reply, and where it was stored and was not meant to be."""
    from tmcm34x.host.exceptions import DownloadModeError
    from tmcm34x.host.steps import FACTORY_RESET
    from tmcm34x.tmcl.status import Status

    if instruction.number == FACTORY_RESET:
        connection.send(instruction)
        return {"text": "sent; this command is never replied to", "exit": 0}
    answer = connection.ask(instruction)
    stored = answer.status == Status.LOADED
    if stored and not loading:
        raise DownloadModeError(instruction, answer.reply)
    return {
        "received": answer.telegram.hex(" "),
        "status": answer.status,
        "value": answer.value,
        "text": "stored" if stored else reply_text(instruction, answer),
        "exit": 0 if answer.status == Status.OK or stored else REFUSED,
    }


def _show(result: dict[str, Any], as_hex: bool) -> None:
    if as_hex:
        click.echo(f"> {result['sent']}")
    if as_hex and result["received"]:
        click.echo(f"< {result['received']}")
    click.echo(f"{result['command']}: {result['text']}")


def reply_text(instruction: Instruction, answer: Any) -> str:
    """A reply for people: the value, or why there is none."""
    from tmcm34x.host.exceptions import refusal_text
    from tmcm34x.tmcl.mnemonic import format_instruction

    if answer.text:
        return answer.text
    if answer.stored is not None:
        return f"stored: {format_instruction(answer.stored)}"
    return str(answer.value) if answer.status == 100 else refusal_text(instruction, answer.status)
