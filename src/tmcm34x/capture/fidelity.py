"""Which entries of the fidelity list a command touches.

`fidelity.tsv` is made from docs/fidelity by docs/generate.py: number, title, confidence, and the commands and
parameters that the entry names.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import NamedTuple

from tmcm34x.tmcl.commands import BY_NUMBER
from tmcm34x.tmcl.datagram import Instruction

MOST: int = 3
"""Entries named for a difference."""


class FidelityEntry(NamedTuple):
    """One entry: where the manual is silent or wrong, and a choice was made."""

    number: str
    title: str
    confidence: str
    keys: frozenset[str]

    def __str__(self) -> str:
        return f"{self.number} {self.title} ({self.confidence or 'no'} confidence)"


@cache
def entries() -> tuple[FidelityEntry, ...]:
    """All of them."""
    text = files("tmcm34x.capture").joinpath("fidelity.tsv").read_text("utf-8")
    rows = [row.split("\t") for row in text.splitlines() if row and not row.startswith("#")]
    return tuple(
        FidelityEntry(number, title, sure, frozenset(keys.split())) for number, title, sure, keys in rows
    )


def keys_of(instruction: Instruction) -> tuple[str, ...]:
    """Names of a command in the list, the most special first: `AP.206`, `GAP`."""
    row = BY_NUMBER.get(instruction.number)
    if row is None:
        return (str(instruction.number),)
    name = row.mnemonic or str(row.number)
    kinds = {operand.kind for operand in row.operands}
    if "axis_parameter" in kinds:
        return f"AP.{instruction.type}", name
    if "global_parameter" in kinds:
        return f"GP.{instruction.type}", name
    return (name,)


def touched(instruction: Instruction) -> list[FidelityEntry]:
    """The entries that name a command, those that name its parameter first; at most `MOST`."""
    found: list[FidelityEntry] = []
    for key in keys_of(instruction):
        found += [entry for entry in entries() if key in entry.keys and entry not in found]
    return found[:MOST]
