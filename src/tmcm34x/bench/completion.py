"""What may be written at a place of a bench file: keys of its table, and values where there are only a few.

The text is one that is being written, so it need not be TOML yet: the headers above the line and the line itself tell
where the cursor is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

from msgspec import inspect

from tmcm34x.bench.description import Bench

_HEADER: Final = re.compile(r"^\s*\[{1,2}\s*([\w.]*)\s*(\]{0,2})")
_KIND: Final = re.compile(r'\bkind\s*=\s*["\'](\w*)["\']')
_VALUE: Final = re.compile(r"([\w.]+)\s*=\s*[\"\']?\w*\Z")
LONGEST: Final = 1000
"""Characters of a line before the cursor; behind more, nothing is suggested: work grows with their square."""


class Suggestion(NamedTuple):
    """What may stand at the cursor.

    detail: type, and whether it is needed
    meaning: what it is, for people
    text: what is to be inserted instead of the word before the cursor
    """

    label: str
    detail: str
    meaning: str
    text: str


def complete(text: str, line: int, column: int) -> list[Suggestion]:
    """Suggestions for the place before `column` of `line`, both from 1."""
    lines = text.split("\n")[:line]
    before = lines[-1][: column - 1] if lines else ""
    if len(before) > LONGEST:
        return []
    if before.lstrip().startswith("[") and "=" not in before:
        return _headers(before)
    header = next((match[1] for text in reversed(lines[:-1]) if (match := _HEADER.match(text))), "")
    return _in_line(_names(header), before)


def _names(dotted: str) -> list[str]:
    return [name for name in dotted.split(".") if name]


def _headers(before: str) -> list[Suggestion]:
    """Names of tables, for a header that is being written."""
    match = _HEADER.match(before)
    *outer, _ = (match[1] if match else "").split(".")
    return [
        found._replace(text=found.label)
        for table in _tables(outer)
        for field in table.fields
        if _structs(field.type) and (found := _suggestion(field))
    ]


def _in_line(names: list[str], before: str) -> list[Suggestion]:
    """Keys or values at the end of a line in the table of a header."""
    inner, rest, kind = _opened(before)
    value = _VALUE.search(rest)
    *dotted, last = (value[1] if value else _dotted(rest)).split(".")
    tables = [table for table in _tables([*names, *inner, *dotted]) if kind in {"", table.tag}]
    if value:
        return list(dict.fromkeys(each for table in tables for each in _values(table, last)))
    kinds = list(_kinds(tables)) if not kind else []
    return list(dict.fromkeys([*kinds, *(_suggestion(field) for table in tables for field in table.fields)]))


def _opened(before: str) -> tuple[list[str], str, str]:
    """Names of the inline tables that are open at the end, what follows in the innermost, and its `kind`."""
    names: list[str] = []
    rest = before
    while "{" in rest:
        outer, _, rest = rest.partition("{")
        if "}" in rest:
            rest = rest.partition("}")[2]
            continue
        key = outer.rpartition(",")[2].partition("=")[0]
        names += _names(key.strip())
    kind = _KIND.search(rest)
    return names, rest.rpartition(",")[2].strip(), kind[1] if kind else ""


def _dotted(rest: str) -> str:
    match = re.search(r"[\w.]*\Z", rest)
    return match[0] if match else ""


def _tables(names: list[str]) -> list[inspect.StructType]:
    """The tables that a path of names may mean."""
    tables = _structs(inspect.type_info(Bench))
    for name in names:
        fields = [field for table in tables for field in table.fields if field.name == name]
        tables = [inner for field in fields for inner in _structs(field.type)]
    return tables


def _structs(info: inspect.Type) -> list[inspect.StructType]:
    """The tables that a value of a type may be, lists of them included."""
    match info:
        case inspect.Metadata():
            return _structs(info.type)
        case inspect.StructType():
            return [info]
        case inspect.ListType():
            return _structs(info.item_type)
        case inspect.UnionType():
            return [inner for option in info.types for inner in _structs(option)]
        case _:
            return []


def _kinds(tables: list[inspect.StructType]) -> Iterator[Suggestion]:
    """`kind = ...` where a table may be one of several."""
    for table in tables:
        if table.tag_field:
            text = f'{table.tag_field} = "{table.tag}"'
            yield Suggestion(text, "kind", (table.cls.__doc__ or "").strip().partition("\n")[0], text)


def _suggestion(field: inspect.Field) -> Suggestion:
    detail = _detail(field.type) + (", needed" if field.required else "")
    return Suggestion(field.name, detail, _meaning(field.type), f"{field.name} = ")


def _meaning(info: inspect.Type) -> str:
    schema: dict[str, Any] = getattr(info, "extra_json_schema", None) or {}
    return str(schema.get("description", ""))


def _detail(info: inspect.Type) -> str:
    match info:
        case inspect.Metadata():
            return _detail(info.type)
        case inspect.UnionType():
            known = [_detail(option) for option in info.types if not isinstance(option, inspect.NoneType)]
            return " or ".join(dict.fromkeys(known))
        case inspect.LiteralType():
            return ", ".join(str(value) for value in info.values)
        case _:
            return _DETAILS.get(type(info), "list")


_DETAILS: Final[Mapping[type[inspect.Type], str]] = {
    inspect.StructType: "table", inspect.BoolType: "true or false", inspect.IntType: "whole number",
    inspect.FloatType: "number", inspect.StrType: "text",
}  # fmt: skip


def _values(table: inspect.StructType, key: str) -> list[Suggestion]:
    """Values of a key that has only a few."""
    if key == table.tag_field:
        return [
            Suggestion(
                f'"{table.tag}"',
                "kind",
                (table.cls.__doc__ or "").strip().partition("\n")[0],
                f'"{table.tag}"',
            )
        ]
    field = next((field for field in table.fields if field.name == key), None)
    return [] if field is None else [Suggestion(text, "", "", text) for text in _choices(field.type)]


def _choices(info: inspect.Type) -> list[str]:
    match info:
        case inspect.Metadata():
            return _choices(info.type)
        case inspect.UnionType():
            return [text for option in info.types for text in _choices(option)]
        case inspect.LiteralType():
            return [f'"{value}"' if isinstance(value, str) else str(value) for value in info.values]
        case inspect.BoolType():
            return ["true", "false"]
        case _:
            return []
