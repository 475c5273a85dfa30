"""Writes `src/tmcm34x/host/attributes.py`: the rows of the parameter tables as attributes with types and docstrings."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

from tmcm34x.tmcl.axis_parameters import ALL, AXIS_PARAMETERS, AxisParameter
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS, GlobalParameter

HEAD = '''\
"""The parameters of chapters 7 and 8 as attributes.  Written by docs/generate.py from the tables: do not edit."""

from tmcm34x.host.parameters import Readable, Writable


class AxisAttributes:
    """The axis parameters, by their keys."""

    __slots__ = ()

'''
MODULE = '''

class ModuleAttributes:
    """The global parameters of bank 0, by their keys."""

    __slots__ = ()

'''


def page() -> str:
    """The text of the module."""
    globals_ = (row for row in GLOBAL_PARAMETERS if row.bank == 0)
    return HEAD + _attributes(AXIS_PARAMETERS) + MODULE + _attributes(globals_)


def _attributes(rows: Iterable[AxisParameter | GlobalParameter]) -> str:
    return "".join(
        f'    {row.key} = {"Writable" if row.writable else "Readable"}("{row.key}")\n{_docstring(row)}'
        for row in rows
    )


def _docstring(row: AxisParameter | GlobalParameter) -> str:
    unit = f" [{row.unit}]" if row.unit else ""
    models = ""
    if isinstance(row, AxisParameter) and row.models != ALL:
        models = f" Only TMCM-{' and '.join(map(str, sorted(row.models)))}."
    meaning = row.meaning.rstrip(".").replace("\\", "")
    text = f'"""{meaning}. {row.low}..{row.high}{unit}, parameter {row.number}.{models}"""'
    return textwrap.fill(text, 108, initial_indent="    ", subsequent_indent="    ") + "\n"
