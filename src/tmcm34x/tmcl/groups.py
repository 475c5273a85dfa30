"""Which parameters belong together, for pages that list them: a title and its numbers, in the order of a page.

Source: the order and the wording of the tables in manual 7.1 and 8.1; the titles are ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

Groups = tuple[tuple[str, tuple[int, ...]], ...]

AXIS_GROUPS: Final[Groups] = (
    ("Position and speed", (0, 1, 8, 2, 3, 4, 5, 135, 130, 138, 213)),
    ("Resolution and divisors", (140, 154, 153)),
    ("Switches and reference search", (9, 10, 11, 12, 13, 149, 193, 194, 195, 196, 141, 197)),
    ("Currents and driver", (6, 7, 214, 204, 203, 211, 200, 206, 205, 208, 207)),
    ("Encoder", (209, 210, 212)),
)
"""Of the axis parameters."""

CHIP_GROUP: Final = "Motion chip and driver chain"
"""Wrong values of these damage the motor drivers (manual 8.1)."""
GLOBAL_GROUPS: Final[Groups] = (
    (CHIP_GROUP, tuple(range(39))),
    ("Serial line", (66, 76, 65, 75, 68, 67, 255)),
    ("CAN", (69, 71, 70, 83)),
    ("Start, pins and protection", (77, 81, 73, 64, 80, 74, 84, 85)),
    ("State", (128, 129, 130, 132, 133)),
)
"""Of bank 0 of the global parameters."""


def _by_number(groups: Groups) -> Mapping[int, str]:
    return MappingProxyType({number: title for title, numbers in groups for number in numbers})


AXIS_GROUP: Final = _by_number(AXIS_GROUPS)
"""Title by the number of an axis parameter."""
GLOBAL_GROUP: Final = _by_number(GLOBAL_GROUPS)
"""Title by the number of a global parameter of bank 0."""
