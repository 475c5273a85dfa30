"""`tmcm34x check`: a recording compared with our module."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.show import read_recording
from tmcm34x.cli.source_files import MODELS, read_bytes

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.capture.check import ReplyDifference

_PATH = click.Path(path_type=Path)
_SHOWN = 20
_EPILOG = """\b
Examples:
  tmcm34x check night.session
  tmcm34x check night.pcapng --model 341 --bench machine.toml --all
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=_PATH)
@click.option("--model", type=click.Choice(MODELS), help="Module type; 343 unless the bench says otherwise.")
@click.option(
    "--bench", type=_PATH, metavar="BENCH", help="What hangs on the module; bare motors without it."
)
@click.option(
    "--eeprom",
    type=_PATH,
    metavar="IMAGE",
    help="The module's memory at the beginning; factory settings without it.",
)
@click.option("--all", "show_all", is_flag=True, help=f"Print all differences, not the first {_SHOWN}.")
@click.option(
    "--strict", is_flag=True, help="Count values that depend on the moment of the question as differences."
)
def command(
    file: Path, model: str | None, bench: Path | None, eeprom: Path | None, *, show_all: bool, strict: bool
) -> int:
    """Play the host's side of the recording FILE against a virtual module, and compare the replies.

    Each difference is printed with the entries of docs/fidelity.md that the command touches: a recording of a real
    module is evidence for or against them.

    Exit status: 0 no difference, 1 differences, 2 wrong usage.
    """  # fmt: skip
    from tmcm34x.capture.check import check
    from tmcm34x.capture.latency import count
    from tmcm34x.capture.record import RecordingError

    records = read_recording(file)
    try:
        differences = check(records, _make_rig(model, bench, eeprom))
    except RecordingError as error:
        raise CliError(f"{file}: {error}") from None
    counted = [difference for difference in differences if strict or not difference.timing]
    for difference in counted if show_all else counted[:_SHOWN]:
        _print(difference)
    hidden = 0 if show_all else max(0, len(counted) - _SHOWN)
    if hidden:
        click.echo(f"and {hidden} more; --all prints them")
    requests = sum(record.direction == ">" for record in records)
    timing = len(differences) - len(counted)
    tail = f", {count(timing, 'value')} that may differ because of the time of the request" if timing else ""
    found = count(len(counted), "difference") if counted else "no difference"
    click.echo(f"{count(requests, 'request')}, {found}{tail}")
    return int(bool(counted))


def _print(difference: ReplyDifference) -> None:
    click.echo(str(difference))
    for entry in difference.entries:
        click.echo(f"{'':14}touches {entry}")


def _make_rig(model: str | None, bench: Path | None, image: Path | None) -> Rig:
    from tmcm34x.bench.rig import BenchError
    from tmcm34x.firmware.storage import Eeprom, EepromError
    from tmcm34x.testing.rigs import make_rig

    try:
        eeprom = None if image is None else Eeprom.from_bytes(read_bytes(image))
        return make_rig(None if model is None else int(model), bench, eeprom=eeprom)
    except EepromError as error:
        raise CliError(f"{image}: {error}") from None
    except BenchError as error:
        raise CliError(str(error)) from None
