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
    from tmcm34x.tmcl.datagram import Instruction

_EXAMPLES = """\b
Examples:
  tmcm34x send "GAP actual_position, 0"
  tmcm34x send "SAP max_speed, 1, 500" "GAP 4, 1"
  tmcm34x send --file setup.txt --yes
"""


@click.command(epilog=_EXAMPLES)
@click.argument("lines", nargs=-1, metavar="COMMAND...")
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
    is 4; without a reply it is 3 and the rest is not sent.
    """
    instructions = _parse(lines or _lines(file))
    with opened(url) as connection:
        _ask(connection, instructions, yes)
        results = [_send(connection, instruction, as_hex and not as_json) for instruction in instructions]
        if as_json:
            print_json([{key: value for key, value in result.items() if key != "line"} for result in results])
        else:
            show_retries(connection)
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


def _send(connection: Connection, instruction: Instruction, as_hex: bool) -> dict[str, Any]:
    from tmcm34x.host.exceptions import ReplyError
    from tmcm34x.host.steps import FACTORY_RESET
    from tmcm34x.tmcl.datagram import pack_request
    from tmcm34x.tmcl.mnemonic import format_instruction

    text = format_instruction(instruction)
    sent = pack_request(connection.address, instruction).hex(" ")
    result: dict[str, Any] = {"command": text, "sent": sent, "received": None, "status": None, "value": None}
    if instruction.number == FACTORY_RESET:
        connection.send(instruction)
        click.echo(f"{text}: sent; this command is never replied to")
        return {**result, "exit": 0}
    try:
        answer = connection.ask(instruction)
    except ReplyError as error:
        click.echo(f"{error}", err=True)
        raise click.exceptions.Exit(NO_REPLY) from error
    result |= {"received": answer.telegram.hex(" "), "status": answer.status, "value": answer.value}
    result |= {"text": answer.text} if answer.text else {}
    result["exit"] = 0 if answer.status == 100 else REFUSED
    if as_hex:
        click.echo(f"> {sent}\n< {answer.telegram.hex(' ')}")
    context = click.get_current_context()
    if not context.params["as_json"]:
        click.echo(f"{text}: {reply_text(instruction, answer)}")
    return result


def reply_text(instruction: Instruction, answer: Any) -> str:
    """A reply for people: the value, or why there is none."""
    from tmcm34x.host.exceptions import refusal_text
    from tmcm34x.tmcl.mnemonic import format_instruction

    if answer.text:
        return answer.text
    if answer.stored is not None:
        return f"stored: {format_instruction(answer.stored)}"
    return str(answer.value) if answer.status == 100 else refusal_text(instruction, answer.status)
