"""Writes the page's side of the wire: `python -m tmcm34x.ide.typescript > web/src/wire.ts`.

Source: `tmcm34x.ide.wire`, which is the definition.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any, Final

import msgspec
from msgspec import inspect as shapes

from tmcm34x.ide import wire

_HEADER: Final = """\
// Written by `python -m tmcm34x.ide.typescript` from src/tmcm34x/ide/wire.py: change that, not this.

/** Bytes in base64. */
export type Base64 = string;
"""

_READERS: Final = {
    "B": ("getUint8", 1), "H": ("getUint16", 2), "h": ("getInt16", 2), "i": ("getInt32", 4), "I": ("getUint32", 4),
    "f": ("getFloat32", 4), "d": ("getFloat64", 8),
}  # fmt: skip
"""`DataView` method and size by `struct` code."""

_DECODE: Final = """\
/** Reads a state frame and gives each group in it to `take`; watched parameters go to `takeWatched`. */
export function readFrame(data: ArrayBuffer, take: (index: number, group: GroupState) => void,
    takeWatched: (values: (number | null)[]) => void): void {
    const view = new DataView(data);
    const mask = view.getUint8(0);
    let at = 1;
    for (let index = 0; index < GROUPS.length; index++) {
        if (!(mask & (1 << index))) continue;
        const group = GROUPS[index]!;
        take(index, group.read(view, at));
        at += group.size;
    }
    if (mask & (1 << WATCH_BIT)) {
        const values: (number | null)[] = [];
        const known = view.getUint8(at++);
        for (; at < data.byteLength; at += 4)
            values.push(known & (1 << values.length) ? view.getInt32(at, true) : null);
        takeWatched(values);
    }
}
"""


def typescript() -> str:
    """The whole of `wire.ts`."""
    return "\n".join([_HEADER, *_constants(), *_groups(), _DECODE, *_interfaces(), *_calls(), *_events()])


def _constants() -> Iterator[str]:
    yield f"export const PROTOCOL = {wire.PROTOCOL};"
    yield f"export const WATCH_BIT = {wire.WATCH_BIT};"
    for name in ("MOTOR_FLAGS", "TIME_FLAGS", "PROGRAM_FLAGS"):
        bits = ", ".join(f"{flag}: {1 << bit}" for bit, flag in enumerate(getattr(wire, name)))
        yield f"export const {name} = {{ {bits} }} as const;"
    curves = ", ".join(f'"{curve.name}"' for curve in wire.CURVES)
    yield f"export const CURVES = [{curves}] as const;"
    yield ""


def _groups() -> Iterator[str]:
    seen: dict[str, str] = {}
    for group in wire.GROUPS:
        name = _state_name(group.name)
        if name in seen:
            continue
        seen[name] = group.name
        yield f"export interface {name}State {{"
        for row in group.rows:
            yield f"    /** {row.meaning} */"
            yield f"    {row.name}: number;"
        yield "}"
        yield ""
        yield f"export const read{name} = (view: DataView, at: number): {name}State => ({{"
        at = 0
        for row in group.rows:
            method, size = _READERS[row.code]
            little = "" if size == 1 else ", true"
            yield f"    {row.name}: view.{method}(at + {at}{little}),"
            at += size
        yield "});"
        yield ""
    yield f"export type GroupState = {' | '.join(f'{name}State' for name in seen)};"
    yield "export const GROUPS: readonly { name: string; size: number;"
    yield "    read: (view: DataView, at: number) => GroupState }[] = ["
    for group in wire.GROUPS:
        reader = f"read{_state_name(group.name)}"
        yield f'    {{ name: "{group.name}", size: {group.layout.size}, read: {reader} }},'
    yield "];"
    yield ""


def _state_name(group: str) -> str:
    return group.rstrip("0123456789").capitalize()


def _interfaces() -> Iterator[str]:
    yield f"export type Severity = {_type(shapes.type_info(wire.Severity))};"
    yield ""
    for shape in wire.Shape.__subclasses__():
        yield from _interface(shape)


def _interface(struct: type[msgspec.Struct]) -> Iterator[str]:
    info = shapes.type_info(struct)
    assert isinstance(info, shapes.StructType)
    yield f"/** {' '.join((struct.__doc__ or '').split())} */"
    yield f"export interface {struct.__name__} {{"
    if info.tag_field is not None:
        yield f'    {info.tag_field}: "{info.tag}";'
    for field in info.fields:
        optional = "" if field.required or not issubclass(struct, wire.Call) else "?"
        yield f"    {field.encode_name}{optional}: {_type(field.type)};"
    yield "}"
    yield ""


def _calls() -> Iterator[str]:
    for call in wire.CALLS:
        yield from _interface(call)
    yield "export type Call = " + " | ".join(call.__name__ for call in wire.CALLS) + ";"
    yield ""
    yield "/** The type of the answer's result, by call. */"
    yield "export interface Results {"
    for call in wire.CALLS:
        info = shapes.type_info(call)
        assert isinstance(info, shapes.StructType)
        result = "null" if call.returns is None else _type(shapes.type_info(call.returns))
        yield f"    {info.tag}: {result};"
    yield "}"
    yield ""


def _events() -> Iterator[str]:
    for event in wire.EVENTS:
        yield from _interface(event)
    yield "export type ServerEvent = " + " | ".join(event.__name__ for event in wire.EVENTS) + ";"
    yield ""


def _type(info: shapes.Type) -> str:
    match info:
        case shapes.StructType():
            return info.cls.__name__
        case shapes.LiteralType():
            return " | ".join(msgspec.json.encode(value).decode() for value in info.values)
        case shapes.ListType():
            inner = _type(info.item_type)
            return f"({inner})[]" if "|" in inner else f"{inner}[]"
        case shapes.DictType():
            return f"Record<{_type(info.key_type)}, {_type(info.value_type)}>"
        case shapes.UnionType():
            return " | ".join(_type(option) for option in info.types)
        case _:
            return _PLAIN[type(info)]


_PLAIN: Final[dict[type[Any], str]] = {
    shapes.IntType: "number", shapes.FloatType: "number", shapes.StrType: "string", shapes.BoolType: "boolean",
    shapes.NoneType: "null", shapes.AnyType: "unknown", shapes.BytesType: "Base64",
}  # fmt: skip


if __name__ == "__main__":
    sys.stdout.write(typescript())
