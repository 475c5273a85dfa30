"""What a wrong name or word in a table was meant to be, or could be: read from the types when it is needed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, cast

from msgspec import inspect

from tmcm34x.toolchain.diagnostics import one_of
from tmcm34x.toolchain.mending.spelling import proposal

_STEP: Final = re.compile(r"\.?([A-Za-z_]\w*)|\[(\d+|\.\.\.)\]")
_UNKNOWN_FIELD: Final = re.compile(r"unknown field `(\w+)`\Z")
_UNKNOWN_VALUE: Final = re.compile(r"[Ii]nvalid (?:enum )?value (?:'(.*)'|(-?\d+))\Z", re.DOTALL)


def hint(problem: str, path: str, table: dict[str, object], kind: type) -> str:
    """The end of the validator's message for a table of type `kind`, empty where no name or word is wrong.

    path: such as ``module[0].axis[1].load``
    """
    field, value = _UNKNOWN_FIELD.search(problem), _UNKNOWN_VALUE.match(problem)
    if field is None and value is None:
        return ""
    steps = [(match[1], match[2]) for match in _STEP.finditer(path)]
    if field is not None:
        return _among(field[1], [*_fields(_at(kind, steps, table), _inner(table, steps))])
    words = [*_words(_at(kind, steps, table))] or [*_tags(_at(kind, steps[:-1], table))]
    return _among(cast("re.Match[str]", value)[1] or "", words)


def _among(name: str, names: list[str]) -> str:
    return proposal(name, names) or (f"; expected {one_of(names)}" if names else "")


def _at(kind: type, steps: list[tuple[str, str]], table: object) -> list[inspect.Type]:
    """The types that may stand at a path."""
    found = list(_plain(inspect.type_info(kind)))
    inner: object = table
    for name, index in steps:
        found = [each for one in found for each in _below(one, name, inner)]
        inner = _inner(inner, [(name, index)])
    return found


def _below(kind: inspect.Type, name: str, table: object) -> Iterator[inspect.Type]:
    if name:
        for field in _struct_fields(kind, table):
            if field.encode_name == name:
                yield from _plain(field.type)
    elif isinstance(kind, inspect.ListType | inspect.VarTupleType):
        yield from _plain(kind.item_type)
    elif isinstance(kind, inspect.DictType):
        yield from _plain(kind.value_type)


def _plain(kind: inspect.Type) -> Iterator[inspect.Type]:
    """A type without what is said of it; the members of a union."""
    if isinstance(kind, inspect.Metadata):
        yield from _plain(kind.type)
    elif isinstance(kind, inspect.UnionType):
        for member in kind.types:
            yield from _plain(member)
    else:
        yield kind


def _struct_fields(kind: inspect.Type, table: object) -> tuple[inspect.Field, ...]:
    """Of a struct, unless the table says by its tag that it is another one."""
    if not isinstance(kind, inspect.StructType):
        return ()
    tag = cast("dict[str, object]", table).get(kind.tag_field or "") if isinstance(table, dict) else None
    return () if tag is not None and tag != kind.tag else kind.fields


def _fields(kinds: list[inspect.Type], table: object) -> Iterator[str]:
    for kind in kinds:
        for field in _struct_fields(kind, table):
            yield field.encode_name


def _words(kinds: list[inspect.Type]) -> Iterator[str]:
    for kind in kinds:
        if isinstance(kind, inspect.LiteralType):
            yield from map(str, kind.values)


def _tags(kinds: list[inspect.Type]) -> Iterator[str]:
    for kind in kinds:
        if isinstance(kind, inspect.StructType) and kind.tag is not None:
            yield str(kind.tag)


def _inner(table: object, steps: list[tuple[str, str]]) -> object:
    """What stands at a path; None where a key of it is not told."""
    for name, index in steps:
        if isinstance(table, dict):
            table = cast("dict[str, object]", table).get(name)
        elif isinstance(table, list) and index.isdigit():
            table = cast("list[object]", table)[int(index)]
        else:
            return None
    return table
