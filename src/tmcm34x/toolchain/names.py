"""The labels and constants of a program: defined in the first pass of the assembler, used in both."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tmcm34x.toolchain.assembly import Symbol, SymbolKind
from tmcm34x.toolchain.diagnostics import did_you_mean, shown
from tmcm34x.toolchain.expressions import (
    FUNCTIONS,
    Operand,
    SourceExpressionError,
    UnknownValueError,
    names_in,
)
from tmcm34x.toolchain.messages import Messages
from tmcm34x.toolchain.parser import SourceLine
from tmcm34x.toolchain.tokens import BLANKS, Token

_DIGITS: Final = str.maketrans("OoIl", "0011")
"""Letters that are typed for digits."""


class Names:
    """Symbols by upper-case name; what looks one up notes where."""

    def __init__(self, messages: Messages) -> None:
        self.symbols: dict[str, Symbol] = {}
        self._messages = messages
        self._broken: set[str] = set()
        """Constants without a value."""

    def define(self, name: Token, kind: SymbolKind, value: float | None, line: SourceLine) -> None:
        """Give a name its value, None where that has a mistake; reports a name that is defined already."""
        key, messages = name.text.upper(), self._messages
        known = self.symbols.get(key)
        if known is not None:
            place = known.definition
            where = (
                f"line {place.line}" if place.file == messages.file else f"{place.file}, line {place.line}"
            )
            text = f"{shown(name.text)} is already a {known.kind} ({where})"
            messages.report("E302", name.start, name.end, text)
            return
        comment = "" if line.comment is None else messages.text[line.comment :].lstrip("/! \t").rstrip()
        location = messages.location(name.start, name.end)
        self.symbols[key] = Symbol(name.text, kind, value or 0.0, location, comment=comment)
        if value is None:
            self._broken.add(key)

    def note(self, operands: Iterable[Operand | None]) -> None:
        """The names in refused operands count as used."""
        for operand in operands:
            for name in names_in(operand):
                symbol = self.symbols.get(name.text.upper())
                if symbol is not None:
                    symbol.references.append(self._messages.location(name.start, name.end))

    def near(self, name: str, candidates: Iterable[str]) -> tuple[str, ...]:
        """The candidates that `name` may be a misspelling of, as they are defined."""
        found = self._messages.near(name, candidates)
        return tuple(self.symbols[one].name if one in self.symbols else one for one in found)

    # Values; these raise `SourceExpressionError`

    def earlier_constant(self, name: Token) -> float:
        """The value of a constant that stands above."""
        symbol = self.symbols.get(name.text.upper())
        if symbol is None:
            near = self.near(name.text, self.symbols)
            text = f"{shown(name.text)} is not defined above this line{did_you_mean(near)}"
            raise SourceExpressionError("E303", name.start, name.end, text, only(near))
        return self._constant(name, symbol)

    def constant(self, name: Token) -> float:
        """The value of a constant."""
        return self._constant(name, self.symbols.get(name.text.upper()) or self._miss(name, "constant"))

    def address(self, name: Token) -> float:
        """Where a jump to a label or constant leads."""
        return self._used(name, self.symbols.get(name.text.upper()) or self._miss(name, "label"))

    def _constant(self, name: Token, symbol: Symbol) -> float:
        value = self._used(name, symbol)
        if symbol.kind == "label":
            text = f"{shown(name.text)} is a label; only JA, JC and CSUB take one"
            raise SourceExpressionError("E304", name.start, name.end, text)
        return value

    def _used(self, name: Token, symbol: Symbol) -> float:
        symbol.references.append(self._messages.location(name.start, name.end))
        if self._broken and name.text.upper() in self._broken:
            raise UnknownValueError(name)
        return symbol.value

    # Names that are not defined

    def _miss(self, name: Token, wanted: SymbolKind) -> Symbol:
        """Raises the diagnostic of a name that is not defined."""
        key = name.text.upper()
        if key in FUNCTIONS:
            text = f"the function {key} needs its operand in parentheses"
            raise SourceExpressionError("E301", name.start, name.end, text)
        near = self.near(key, (n for n, symbol in self.symbols.items() if symbol.kind == wanted))
        if not near and wanted == "constant" and _is_number(name.text):
            near = (name.text.translate(_DIGITS),)
        if not near:
            self._look_for_comment(name)
        text = f"no {wanted} {shown(name.text)}{did_you_mean(near)}"
        raise SourceExpressionError("E301", name.start, name.end, text, only(near))

    def _look_for_comment(self, name: Token) -> None:
        """A name after `--` or `/` may begin a comment of another language."""
        before = self._messages.text[: name.start].rstrip(BLANKS)
        for marker in ("--", "/"):
            if before.endswith((f" {marker}", f"\t{marker}")):
                text = f"no constant {shown(name.text)}; a comment begins with //, not with {marker!r}"
                raise SourceExpressionError("E301", len(before) - len(marker), len(before), text, "//")


def _is_number(name: str) -> bool:
    """Whether a name is a number with letters for digits: `l500`, or `O` alone; `Io` is a name."""
    return set(name) <= set("OoIl0123456789") and (len(name) == 1 or any(map(str.isdecimal, name)))


def only(near: tuple[str, ...]) -> str | None:
    """The one name that is meant; None where there are none or several."""
    return near[0] if len(near) == 1 else None
