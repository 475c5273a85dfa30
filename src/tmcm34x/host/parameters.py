"""What makes a row of a table an attribute: reading it asks the module, assigning to it sets it there.

`attributes`, which is generated, has one for each row.
"""

from __future__ import annotations

from typing import Any, Protocol, Self, TypeVar, overload

from tmcm34x.host.exceptions import NotAvailableError, RangeError
from tmcm34x.tmcl.axis_parameters import AxisParameter
from tmcm34x.tmcl.global_parameters import GlobalParameter

ParameterRow = AxisParameter | GlobalParameter
R = TypeVar("R", AxisParameter, GlobalParameter)


class Owner(Protocol):
    """What has parameters: an axis or a module."""

    def read(self, key: str) -> int:
        """The value that the module has."""
        ...

    def write(self, key: str, value: int) -> None:
        """Set the value in the module."""
        ...


class Readable:
    """A parameter that can only be read."""

    def __init__(self, key: str) -> None:
        self.key = key

    @overload
    def __get__(self, owner: None, kind: Any) -> Self: ...
    @overload
    def __get__(self, owner: Owner, kind: Any) -> int: ...
    def __get__(self, owner: Owner | None, kind: Any) -> Self | int:
        return self if owner is None else owner.read(self.key)


class Writable(Readable):
    """A parameter that can be read and set."""

    def __set__(self, owner: Owner, value: int) -> None:
        owner.write(self.key, value)


def row_of(rows: Any, key: str, kind: str) -> Any:
    """The row of a parameter by its key.  Raises `AttributeError`."""
    row = rows.get(key)
    if row is None:
        raise AttributeError(f"no {kind} parameter {key!r}")
    return row


def check_write(row: ParameterRow, value: int) -> None:
    """Raises `RangeError` where the table says that a module would refuse the value."""
    if not row.writable:
        raise RangeError(f"{row.key} ({row.number}) can only be read")
    if not row.low <= value <= row.high:
        unit = f" {row.unit}" if row.unit else ""
        raise RangeError(f"{row.key} ({row.number}) is {row.low} to {row.high}{unit}, not {value}")


def check_model(row: AxisParameter, model: int) -> None:
    """Raises `NotAvailableError` where the model does not have the parameter."""
    if model not in row.models:
        raise NotAvailableError(f"{row.key} ({row.number}) is not available on a TMCM-{model}")
