"""`tmcm34x monitor`: a module at work."""

from __future__ import annotations

import csv
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.cli import FiniteRange
from tmcm34x.cli.host.common import SilentModuleError, opened, port_option
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection
    from tmcm34x.host.monitor import Column, Sample
    from tmcm34x.host.reading import Reading

_BARS: Final = "▁▂▃▄▅▆▇█"
_PLOT_WIDTH: Final = 60
PATIENCE: Final = 3
"""Looks in a row without any reply until the module counts as lost."""


@click.command()
@click.option(
    "--rate",
    type=FiniteRange(0, 100, min_open=True),
    default=5.0,
    show_default=True,
    metavar="HZ",
    help="Updates per second.",
)
@click.option("--csv", "as_csv", is_flag=True, help="Print comma-separated values instead of the table.")
@click.option("--plot", is_flag=True, help="Draw the actual speeds over time under the table.")
@click.option(
    "--motor",
    "motors",
    multiple=True,
    type=click.IntRange(0, MOTORS - 1),
    help="Only this motor; may be given several times.",
)
@click.option(
    "--drivers",
    is_flag=True,
    help="Read load, driver flags and encoders too; for them the module exchanges datagrams.",
)
@click.option("--count", type=click.IntRange(1), metavar="N", help="End after N updates.")
@port_option
def command(
    *,
    rate: float,
    as_csv: bool,
    plot: bool,
    motors: tuple[int, ...],
    drivers: bool,
    count: int | None,
    url: str | None,
) -> int:
    """Show positions, speeds, currents, switches, inputs and the program, until Ctrl+C.

    A value that the module refuses or does not reply to is shown as such, never as 0.
    """
    from tmcm34x.host import monitor, settings

    if as_csv and plot:
        raise click.UsageError("--plot is for the table")
    with opened(url) as connection:
        model, version = connection.run(settings.identify())
        wanted = monitor.columns(model, motors or range(MOTORS), drivers=drivers)
        samples = _samples(connection, wanted, 1 / rate, count)
        if as_csv:
            _write_csv(wanted, samples)
        else:
            _show(f"{version} at {connection.line.name}", samples, plot)
    return 0


def _samples(
    connection: Connection, wanted: Sequence[Column], period_s: float, count: int | None
) -> Iterator[Sample]:
    """Looks at a steady rate, or as fast as the line allows."""
    from tmcm34x.host.monitor import sample
    from tmcm34x.host.reading import Silent

    done, silent = 0, 0
    while count is None or done < count:
        found = connection.run(sample(wanted))
        silent = silent + 1 if any(isinstance(r, Silent) for r in found.readings.values()) else 0
        if silent >= PATIENCE:
            raise SilentModuleError("the module has stopped replying; check power and wiring")
        yield found
        done += 1
        connection.wait(max(0.0, found.time_s + period_s - connection.line.now()))


def _cell(found: Reading) -> str:
    """A table cell: a value, or one word for why there is none."""
    from tmcm34x.host.reading import Absent, Refused, Value

    match found:
        case Value(number):
            return str(number)
        case Refused(status):
            return f"refused {status}"
        case Absent():
            return "n/a"
        case _:
            return "no reply"


def _write_csv(wanted: Sequence[Column], samples: Iterator[Sample]) -> None:
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["time_s", *(_name(column) for column in wanted)])
    start: float | None = None
    for found in samples:
        start = found.time_s if start is None else start
        cells = (_cell(found.readings[column]) for column in wanted)
        writer.writerow([f"{found.time_s - start:.3f}", *cells])
        sys.stdout.flush()


def _name(column: Column) -> str:
    return column.name if column.motor is None else f"motor{column.motor}.{column.name}"


def _show(title: str, samples: Iterator[Sample], plot: bool) -> None:
    from rich.console import Group
    from rich.live import Live

    histories: dict[int, deque[int | None]] = {}
    with Live(auto_refresh=False) as live:
        for found in samples:
            parts: list[Any] = [_table(title, found)]
            if plot:
                parts += _plots(found, histories)
            live.update(Group(*parts), refresh=True)


def _table(title: str, found: Sample) -> Any:
    from rich.table import Table

    motors = sorted({column.motor for column in found.readings if column.motor is not None})
    table = Table(title=title)
    table.add_column("")
    for motor in motors:
        table.add_column(f"motor {motor}", justify="right")
    names = dict.fromkeys(column.name for column in found.readings if column.motor is not None)
    cells = {(column.name, column.motor): _cell(r) for column, r in found.readings.items()}
    for name in names:
        table.add_row(name.replace("_", " "), *(cells[name, motor] for motor in motors))
    for column, reading in found.readings.items():
        if column.motor is None:
            table.add_row(column.name.replace("_", " "), _state(column.name, _cell(reading)))
    return table


def _state(name: str, cell: str) -> str:
    """What the program does, in the word of the table of global parameters; any other cell as it is."""
    from tmcm34x.tmcl.global_parameters import BY_KEY

    row = BY_KEY.get(name)
    return cell if row is None else {str(number): word for number, word in row.choices}.get(cell, cell)


def _plots(found: Sample, histories: dict[int, deque[int | None]]) -> Iterator[str]:
    from tmcm34x.host.reading import Value

    for column, reading in found.readings.items():
        if column.name == "actual_speed" and column.motor is not None:
            history = histories.setdefault(column.motor, deque(maxlen=_PLOT_WIDTH))
            history.append(reading.value if isinstance(reading, Value) else None)
            yield f"speed {column.motor} {_bars(history)}"


def _bars(history: Sequence[int | None]) -> str:
    """A line of bars between the lowest and the highest value; a gap where there was no value."""
    known = [number for number in history if number is not None]
    low, high = (min(known, default=0), max(known, default=0))
    span = max(1, high - low)
    draw: Callable[[int], str] = lambda number: _BARS[(number - low) * (len(_BARS) - 1) // span]  # noqa: E731
    return "".join(" " if number is None else draw(number) for number in history) + f"  {low}..{high}"
