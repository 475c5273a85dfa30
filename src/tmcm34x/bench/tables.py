"""What the tables of a bench file are made of: structs with texts for each key, and the numbers in them."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class Struct(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A table of the file; unknown keys are errors."""


def text(meaning: str) -> Meta:
    """What a key means, for the reference page and completion."""
    return Meta(description=meaning)


Positive = Annotated[float, Meta(gt=0)]
Period = Annotated[float, Meta(ge=0.01)]
Count = Annotated[int, Meta(ge=1)]
NotNegative = Annotated[float, Meta(ge=0)]
Level = Annotated[int, Meta(ge=0, le=1023)]
Bit = Annotated[int, Meta(ge=0, le=1)]
Byte = Annotated[int, Meta(ge=0, le=255)]
Index = Annotated[int, Meta(ge=0)]
MotorNumber = Annotated[int, Meta(ge=0, le=2)]
ModelNumber = Literal[341, 342, 343]
