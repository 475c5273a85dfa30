"""Rows and functions of all parameters, put together for one model and profile."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from tmcm34x.firmware.parameters import axis, bank_0
from tmcm34x.firmware.state import Tables
from tmcm34x.tmcl.axis_parameters import axis_rows
from tmcm34x.tmcl.global_parameters import global_rows

if TYPE_CHECKING:
    from tmcm34x.firmware.state import AxisReader, AxisWriter, GlobalReader
    from tmcm34x.tmcl.axis_parameters import AxisParameter


@cache
def tables(model: int, profile: str) -> Tables:
    """The tables of `model` (341..343) with `profile` ("standard" or "later")."""
    readers: list[AxisReader | None] = [None] * 256
    writers: list[tuple[AxisParameter, AxisWriter] | None] = [None] * 256
    rows = axis_rows(model, profile)
    for row in rows:
        if row.readable:
            readers[row.number] = axis.READERS.get(row.number, axis.read_ram)
        if row.writable:
            writers[row.number] = row, axis.WRITERS.get(row.number, axis.write_ram)
    settings = global_rows(profile)
    global_readers: list[GlobalReader | None] = [None] * 256
    for setting in settings:
        if setting.readable:
            global_readers[setting.number] = bank_0.READERS.get(setting.number, bank_0.read_stored)
    return Tables(
        tuple(readers),
        tuple(writers),
        frozenset(row.number for row in rows if row.stored),
        frozenset(row.number for row in settings),
        tuple(global_readers),
        {
            row.number: (row, bank_0.WRITERS.get(row.number, bank_0.write_stored))
            for row in settings
            if row.writable
        },
    )
