"""`tmcm34x show`: a recording decoded, or in another form."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.outputs import FILE_IN, FILE_OUT

if TYPE_CHECKING:
    from tmcm34x.capture.latency import TimedRecord
    from tmcm34x.capture.record import Record

_EPILOG = """\b
Examples:
  tmcm34x show night.session
  tmcm34x show night.session --to night.pcapng
  tmcm34x show --dissector > tmcl.lua
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=FILE_IN, required=False)
@click.option(
    "--to",
    "out",
    type=FILE_OUT,
    metavar="OUT",
    help="Write OUT instead: .session, .pcapng, .log (candump) or .hex.",
)
@click.option("--anonymous", is_flag=True, help="Leave out texts and names of lines in OUT.")
@click.option("--dissector", "lua", is_flag=True, help="Print the dissector for Wireshark.")
def command(file: Path | None, out: Path | None, *, anonymous: bool, lua: bool) -> int:
    """Show the recording FILE: every telegram with its time, its meaning, and the latency of replies.

    FILE is a session with times, a pcapng file, a log of candump, or a text log of telegrams in hexadecimal.
    """
    if lua:
        from tmcm34x.capture.dissector import dissector

        click.echo(dissector(), nl=False)
        return 0
    if file is None:
        raise click.UsageError("Name the recording FILE to show.")
    records = read_recording(file)
    if out is None:
        _print(records)
    else:
        _write(records, out, anonymous)
    return 0


def read_recording(path: Path) -> list[Record]:
    """The records of a file; a `CliError` where there are none."""
    from tmcm34x.capture.files import read
    from tmcm34x.capture.record import RecordingError

    try:
        return read(path)
    except RecordingError as error:
        raise CliError(str(error)) from None


def _write(records: list[Record], out: Path, anonymous: bool) -> None:
    from tmcm34x.capture.files import write
    from tmcm34x.capture.record import RecordingError

    try:
        count = write(records, out, anonymous=anonymous)
    except RecordingError as error:
        raise CliError(str(error)) from None
    left_out = (
        f", {len(records) - count} left out: candump takes CAN frames only" if count < len(records) else ""
    )
    click.echo(f"{out}: {count} records{left_out}")


def _print(records: list[Record]) -> None:
    from tmcm34x.capture.latency import rows, summary

    start_ns = records[0].time_ns
    for row in rows(records):
        click.echo(_line(row, start_ns))
    click.echo(summary(records))


def _line(row: TimedRecord, start_ns: int) -> str:
    record = row.record
    latency = "" if row.latency_ns is None else f"{row.latency_ns / 1e6:9.3f} ms"
    name = f"{record.identifier:03x} " if record.kind == "frame" else ""
    dump = name + record.data.hex(" ")
    time_s = (record.time_ns - start_ns) / 1e9
    return f"{time_s:13.6f} s {record.direction} {dump:<27} {latency:>12}  {record.meaning.text}"
