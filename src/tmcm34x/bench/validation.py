"""Tables of a file as values of a type.  What does not fit is told with its path in front and with what fits there."""

from __future__ import annotations

from typing import TypeVar

import msgspec

T = TypeVar("T")


class TableError(ValueError):
    """A table that does not fit; one line such as ``module[1].axis[0].motor: expected ...``."""


def convert(table: dict[str, object], kind: type[T]) -> T:
    """The value of type `kind` in a table.  Raises `TableError`."""
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        raise TableError(_line(str(error), table, kind)) from None


def _line(message: str, table: dict[str, object], kind: type) -> str:
    from tmcm34x.bench.hints import hint

    problem, _, path = message.partition(" - at `$")
    path = path.rstrip("`").lstrip(".")
    told = problem[0].lower() + problem[1:].replace("`", "") + hint(problem, path, table, kind)
    return f"{path}: {told}" if path else told
