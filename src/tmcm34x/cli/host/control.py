"""`tmcm34x status`, `start`, `stop`, `step`, `reset`, `factory-reset`: what a module does."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.cli.host.common import (
    confirm,
    json_option,
    opened,
    port_option,
    print_json,
    show_retries,
    yes_option,
)
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection
    from tmcm34x.host.reading import Reading
    from tmcm34x.host.steps import Steps

STATES: Final = ("stopped", "running", "stepping", "reset")
_RESTART_S: Final = 1.0


def _control(work: Callable[..., int]) -> Callable[..., int]:
    @functools.wraps(work)
    def run(url: str | None, **options: Any) -> int:
        with opened(url) as connection:
            return work(connection, **options)

    return run


@click.command()
@click.option(
    "--at", "address", type=click.IntRange(0, 2047), metavar="ADDRESS", help="Start at this address."
)
@click.option(
    "--continue", "go_on", is_flag=True, help="Go on where the program stands, instead of at its start."
)
@port_option
@yes_option
@_control
def start(connection: Connection, address: int | None, go_on: bool, yes: bool) -> int:
    """Start the program in the program memory of the module."""
    from tmcm34x.host import program

    confirm(connection, "the program starts and may move motors", yes)
    connection.run(program.run(address) if go_on or address is not None else program.restart())
    return _say_state(connection)


@click.command()
@click.option("--all", "everything", is_flag=True, help="Stop all motors too, along their ramps.")
@port_option
@_control
def stop(connection: Connection, everything: bool) -> int:
    """Stop the program of the module, and end a download mode that was left on.

    Every command is sent until it is acknowledged. A motor that the program has started goes on turning without --all.
    """
    from tmcm34x.host import motion, program

    def tell(line: str) -> None:
        click.echo(line, err=True)

    connection.run(motion.stop_all(tell) if everything else program.stop(tell))
    show_retries(connection)
    return _say_state(connection)


@click.command()
@port_option
@yes_option
@_control
def step(connection: Connection, yes: bool) -> int:
    """Execute one command of the program of the module."""
    from tmcm34x.host import program

    confirm(connection, "one command of the program is executed and may move a motor", yes)
    connection.run(program.step())
    return _say_state(connection)


@click.command()
@port_option
@_control
def reset(connection: Connection) -> int:
    """Stop the program of the module and go back to its start."""
    from tmcm34x.host import program

    connection.run(program.reset())
    return _say_state(connection)


def _say_state(connection: Connection) -> int:
    from tmcm34x.host import program

    state = connection.run(program.state())
    click.echo(f"program {STATES[state.status & 3]} at address {state.counter}")
    return 0


@click.command()
@port_option
@json_option
@_control
def status(connection: Connection, as_json: bool) -> int:
    """Show what the module is doing: program, motors, switches.

    A value that could not be read is named as such, and the exit status is 1.
    """
    from tmcm34x.host.reading import Value

    readings = connection.run(_read_status())
    missing = [key for key, found in readings.items() if not isinstance(found, Value)]
    if as_json:
        print_json({key: _plain(found) for key, found in readings.items()})
    else:
        for key, found in readings.items():
            click.echo(f"{key:28} {_state_text(key, found)}")
        show_retries(connection)
    return 1 if missing else 0


def _read_status() -> Steps[dict[str, Reading]]:
    from tmcm34x.host.settings import identify
    from tmcm34x.host.steps import NUMBERS, reading
    from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

    _, version = yield from identify()
    click.echo(f"firmware {version}", err=True)
    readings: dict[str, Reading] = {}
    for key in ("application_status", "program_counter", "download_mode"):
        readings[key] = yield from reading(Instruction(NUMBERS["GGP"], GLOBAL_KEYS[key].number))
    for motor in range(MOTORS):
        for key in ("actual_position", "target_position", "actual_speed", "left_switch", "right_switch"):
            command = Instruction(NUMBERS["GAP"], AXIS_KEYS[key].number, motor)
            readings[f"motor {motor} {key}"] = yield from reading(command)
    return readings


def _state_text(key: str, found: Reading) -> str:
    from tmcm34x.host.reading import Value

    if key == "application_status" and isinstance(found, Value):
        return STATES[found.value & 3]
    return found.text


def _plain(found: Reading) -> Any:
    from tmcm34x.host.reading import Value

    return found.value if isinstance(found, Value) else {"missing": found.text}


@click.command("factory-reset")
@port_option
@yes_option
@_control
def factory_reset(connection: Connection, yes: bool) -> int:
    """Put all stored settings back to their factory defaults and restart the module.

    Address, bit rate and CAN identifiers go back too; the program stays (fidelity FW-11). The module does not reply;
    afterwards it is looked for at 9600 baud and address 1.
    """
    from tmcm34x.host.exceptions import RefusedError
    from tmcm34x.host.program import quit_download
    from tmcm34x.host.program import stop as stop_program
    from tmcm34x.host.settings import identify
    from tmcm34x.host.steps import FACTORY_RESET, NUMBERS, Follow, value
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.tmcl.global_parameters import BAUD_RATES, FACTORY_KEY
    from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

    _, version = connection.run(identify())
    lock = connection.run(value(Instruction(NUMBERS["GGP"], GLOBAL_KEYS["eeprom_lock"].number)))
    confirm(connection, f"the {version} loses all its settings, address and bit rate included", yes)
    if lock:
        raise RefusedError(Instruction(FACTORY_RESET), _locked())
    connection.run(stop_program())
    connection.run(quit_download())
    connection.send(Instruction(FACTORY_RESET, value=FACTORY_KEY))
    connection.wait(_RESTART_S)
    connection.address = connection.line.follow(
        Follow(address=GLOBAL_KEYS["serial_address"].default, baud=BAUD_RATES[0], can_id=1, can_reply=2),
        connection.address,
    )
    connection.forget()
    _, version = connection.run(identify())
    click.echo(f"{version}: factory settings, address {connection.address}")
    return 0


def _locked() -> Any:
    from tmcm34x.tmcl.datagram import Reply
    from tmcm34x.tmcl.status import Status

    return Reply(0, 0, Status.EEPROM_LOCKED, 137)
