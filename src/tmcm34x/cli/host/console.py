"""`tmcm34x console`: direct mode at a prompt."""

from __future__ import annotations

import contextlib
import importlib.util
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from tmcm34x.cli.host.common import confirm, opened, port_option, show_retries, yes_option
from tmcm34x.cli.host.send import reply_text

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection
    from tmcm34x.tmcl.datagram import Instruction

PROMPT: Final = "tmcl> "
HISTORY: Final = ".tmcm34x_history"
_HELP: Final = """\
A line is a command: GAP actual_position, 0   SAP 4, 1, 500   get_firmware_version
help NAME      what a command or parameter is          help             this text
units MOTOR    what the speeds of a motor are           hex on|off       show the bytes
ascii          the ASCII interface (ABIN leaves it)     quit             leave; Ctrl+D does too
"""


@click.command()
@port_option
@yes_option
def command(url: str | None, yes: bool) -> int:
    """Talk to a module line by line, with completion by Tab, help from the tables, and a history.

    Before the first command that moves a motor or writes the EEPROM of a module that may be real, it asks once.
    """
    from tmcm34x.host.exceptions import DownloadModeError
    from tmcm34x.host.steps import executing

    with opened(url) as connection:
        click.echo(f"{connection.version()} at {connection.line.name}; type help for the commands")
        try:
            connection.run(executing())
        except DownloadModeError as error:
            click.echo(str(error), err=True)
        console = Console(connection, yes)
        with _line_editing():
            for line in _lines():
                if not console.take(line):
                    break
        show_retries(connection)
    return 0


class Console:
    """What the lines of a console do."""

    def __init__(self, connection: Connection, yes: bool) -> None:
        self._connection = connection
        self._yes = yes
        self._hex = False
        self._own: dict[str, Callable[[str], None]] = {
            "help": self._help,
            "units": self._units,
            "hex": self._set_hex,
            "ascii": self._ascii,
        }

    def take(self, line: str) -> bool:
        """Do what a line says; False ends the console."""
        word, _, rest = line.strip().partition(" ")
        if word.lower() in {"quit", "exit"}:
            return False
        own = self._own.get(word.lower())
        if own is not None:
            own(rest.strip())
        elif word and not word.startswith("//"):
            self._send(line)
        return True

    def _send(self, line: str) -> None:
        from tmcm34x.host.direct import parse_line
        from tmcm34x.host.exceptions import LinkError, ReplyError
        from tmcm34x.host.steps import FACTORY_RESET
        from tmcm34x.tmcl.datagram import pack_request
        from tmcm34x.tmcl.mnemonic import MnemonicError

        try:
            instruction = parse_line(line)
            if not self._may(instruction):
                return
            if instruction.number == FACTORY_RESET:
                self._connection.send(instruction)
                click.echo("sent; this command is never replied to")
                return
            answer = self._connection.ask(instruction)
        except (MnemonicError, ReplyError) as error:
            click.echo(str(error))
            return
        except LinkError:
            raise
        if self._hex:
            click.echo(f"> {pack_request(self._connection.address, instruction).hex(' ')}")
            click.echo(f"< {answer.telegram.hex(' ')}")
        click.echo(f"{reply_text(instruction, answer)}{_meaning(instruction, answer.value, answer.status)}")

    def _may(self, instruction: Instruction) -> bool:
        """Whether a command may go out; the first that acts asks for all."""
        from tmcm34x.host.effects import consequence, warning

        text = warning(instruction)
        if not text or (self._yes and not consequence(instruction)):
            return True
        try:
            confirm(self._connection, text, False)
        except click.Abort:
            return False
        self._yes = True
        return True

    def _help(self, name: str) -> None:
        click.echo(_HELP.rstrip() if not name else help_text(name))

    def _units(self, text: str) -> None:
        from tmcm34x.host.module import Module
        from tmcm34x.tmcl.commands import MOTORS

        if not (text.isdecimal() and int(text) < MOTORS):
            click.echo(f"units MOTOR, with a motor of 0..{MOTORS - 1}")
            return
        axis = Module(self._connection).axes[int(text)]
        scale = axis.physical().scale
        for key in ("actual_speed", "max_speed"):
            speed = axis.read(key)
            click.echo(
                f"{key}: {speed} = {scale.steps_s(speed):.6g} full steps/s = {scale.rev_min(speed):.6g} rev/min"
            )
        acceleration = axis.max_acceleration
        click.echo(f"max_acceleration: {acceleration} = {scale.steps_s2(acceleration):.6g} full steps/s²")

    def _set_hex(self, text: str) -> None:
        self._hex = text != "off"

    def _ascii(self, _: str) -> None:
        """Lines as they are, until ABIN."""
        from tmcm34x.host.steps import ASCII_MODE
        from tmcm34x.tmcl.datagram import Instruction

        connection = self._connection
        connection.ask(Instruction(ASCII_MODE))
        letter = chr(ord("A") + connection.address - 1) if connection.address else "A"
        click.echo(f"ASCII interface; lines begin with the address {letter}, {letter}BIN leaves it")
        for line in _lines("ascii> "):
            connection.line.write(line.encode("ascii", "replace") + b"\r")
            connection.line.sleep(0.2)
            click.echo(connection.line.waiting().decode("latin-1").replace("\r", "\n").rstrip())
            if line.strip().upper() == f"{letter}BIN":
                break
        connection.forget()


def _meaning(instruction: Instruction, number: int, status: int) -> str:
    """The choice that a value stands for, or its unit."""
    from tmcm34x.host.steps import NUMBERS
    from tmcm34x.tmcl.axis_parameters import BY_NUMBER as AXIS
    from tmcm34x.tmcl.global_parameters import BY_NUMBER as GLOBALS

    if status != 100 or instruction.number not in {NUMBERS["GAP"], NUMBERS["GGP"]}:
        return ""
    is_axis = instruction.number == NUMBERS["GAP"]
    row = AXIS.get(instruction.type) if is_axis else GLOBALS.get((instruction.motor, instruction.type))
    if row is None:
        return ""
    text = dict(row.choices).get(number, row.unit)
    return f" {text}" if text else ""


def help_text(name: str) -> str:
    """What a command or parameter is, from its row."""
    from tmcm34x.host.direct import CONTROLS
    from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
    from tmcm34x.tmcl.commands import BY_MNEMONIC, BY_NUMBER
    from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

    row = BY_MNEMONIC.get(name.upper()) or BY_NUMBER.get(CONTROLS.get(name.lower(), -1))
    if row is not None:
        return f"{row.syntax or row.number}: {row.meaning} (manual {row.section})"
    parameter = AXIS_KEYS.get(name.lower()) or GLOBAL_KEYS.get(name.lower())
    if parameter is None:
        return f"there is no command or parameter {name}"
    choices = "".join(f"; {number} {text}" for number, text in parameter.choices)
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{parameter.number} {parameter.name}, {parameter.low}..{parameter.high}{unit}: {parameter.meaning}{choices}"


def completions(text: str, line: str) -> list[str]:
    """What the word `text` at the end of `line` may become."""
    from tmcm34x.host.direct import CONTROLS
    from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
    from tmcm34x.tmcl.commands import BY_MNEMONIC
    from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

    words = line.replace(",", " ").split()
    first = words[0] if words else ""
    if line.strip() == text:
        known: list[str] = [*BY_MNEMONIC, *CONTROLS, "help", "units", "hex", "ascii", "quit"]
    elif first.lower() == "help":
        known = [*BY_MNEMONIC, *CONTROLS, *AXIS_KEYS, *GLOBAL_KEYS]
    else:
        row = BY_MNEMONIC.get(first.upper())
        kinds = {operand.kind for operand in row.operands} if row else set[str]()
        known = [
            *(AXIS_KEYS if "axis_parameter" in kinds else ()),
            *(GLOBAL_KEYS if "global_parameter" in kinds else ()),
        ]
        known += [word for operand in (row.operands if row else ()) for word, _ in operand.words]
    return [name for name in known if name.lower().startswith(text.lower())]


def _lines(prompt: str = PROMPT) -> Iterator[str]:
    while True:
        try:
            yield input(prompt if sys.stdin.isatty() else "")
        except EOFError:
            return


@contextlib.contextmanager
def _line_editing() -> Generator[None]:
    """History and completion where Python has `readline`; Windows edits lines by itself."""
    if sys.platform == "win32" or importlib.util.find_spec("readline") is None:
        yield
        return
    import readline

    path = Path.home() / HISTORY
    with contextlib.suppress(OSError):
        readline.read_history_file(path)
    readline.set_completer_delims(" ,\t")
    readline.set_completer(lambda text, state: _nth(completions(text, readline.get_line_buffer()), state))
    readline.parse_and_bind("tab: complete")
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            readline.set_history_length(1000)
            readline.write_history_file(path)


def _nth(found: list[str], n: int) -> str | None:
    return found[n] if n < len(found) else None
