"""Include files: the one that comes with the tool chain, names without regard to case, who includes whom.

`TMCLParam.tmc` gives the parameters their names, as the file of that name does that the TMCL-IDE ships; its text is
made from the tables of the parameters (fidelity TOOL-15).
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from typing import Final

from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS

PARAMETERS: Final = "TMCLParam.tmc"
SOURCES: Final = frozenset({".tmc", ".tmcl", ".inc", ".txt"})
"""Suffixes of the files that may include others."""
MOST_NEIGHBOURS: Final = 200
"""Files of a folder that are read to find the program to which an include file belongs."""
_INCLUDE: Final = re.compile(
    r"^[ \t]*#[ \t]*include[ \t]+([^\r\n]+?)[ \t]*(?://.*)?$", re.IGNORECASE | re.MULTILINE
)
_QUOTES: Final = {'"': '"', "<": ">", "'": "'"}
_LONGER: Final = {"MaxSpeed": "MaxPositioningSpeed"}
"""Names that differ from the keys of the parameters: the vendor's manuals print them."""


def standard(name: str) -> tuple[str, str] | None:
    """The file that the tool chain itself has for `name`, and its text; None where it has none."""
    if posixpath.basename(name.replace("\\", "/")).lower() != PARAMETERS.lower():
        return None
    return f"<{PARAMETERS}>", _parameters()


def is_standard(file: str) -> bool:
    """Whether a file is the tool chain's own, which is nowhere on the disk."""
    return file == f"<{PARAMETERS}>"


@cache
def _parameters() -> str:
    lines = [
        "// The names of the axis parameters (AP), of the global parameters in bank 0 (GP) and of the motors.",
        "",
    ]
    lines += [f"{'AP' + _camel(row.key):<32} = {row.number:>3}    // {row.name}" for row in AXIS_PARAMETERS]
    lines.append("")
    lines += [
        f"{'GP' + _camel(row.key):<32} = {row.number:>3}    // {row.name}"
        for row in GLOBAL_PARAMETERS
        if row.bank == 0
    ]
    lines.append("")
    lines += [f"{f'Motor{motor}':<32} = {motor:>3}" for motor in range(MOTORS)]
    return "\n".join([*lines, ""])


def _camel(key: str) -> str:
    name = "".join(word.capitalize() for word in key.split("_"))
    return _LONGER.get(name, name)


def unquoted(name: str) -> str:
    """The name of a file as written after `#include`, without quotes or angle brackets."""
    return name[1:-1] if len(name) > 2 and _QUOTES.get(name[0]) == name[-1] else name


def fitting(name: str, names: Iterable[str]) -> str | None:
    """The one of `names` that is `name`, or the only one that is so without regard to case."""
    every = list(names)
    if name in every:
        return name
    alike = [other for other in every if other.lower() == name.lower()]
    return alike[0] if len(alike) == 1 else None


def included(text: str) -> list[str]:
    """The base names of the files that a source text includes itself, in lower case."""
    return [posixpath.basename(unquoted(name).replace("\\", "/")).lower() for name in _INCLUDE.findall(text)]


def programs_with(name: str, names: Sequence[str], read: Callable[[str], str]) -> Iterator[str]:
    """The files among `names` that include `name`, directly or through others, and are included by none themselves.

    names: all files of a folder; those that `read` cannot read count as including nothing
    """
    users: dict[str, set[str]] = {}
    for other in names:
        try:
            for one in included(read(other)):
                users.setdefault(one, set()).add(other)
        except (OSError, ValueError):
            continue
    seen: set[str] = set()
    waiting = sorted(users.get(name.lower(), ()))
    while waiting:
        other = waiting.pop(0)
        if other in seen or other.lower() == name.lower():
            continue
        seen.add(other)
        above = sorted(users.get(other.lower(), set()) - {other})
        if not above:
            yield other
        waiting += above
