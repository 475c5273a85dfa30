"""The open files of an editor, and the programs that they belong to.

A file that another open file includes belongs to that program and is judged as a part of it, because alone it
would be full of unknown names.  An open file stands before the one on disk, as in the TMCL-IDE.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Final, Protocol

from tmcm34x.editor.analysis.program import Analysis
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.includes import MOST_NEIGHBOURS, SOURCES, fitting, programs_with
from tmcm34x.toolchain.linter import DEFAULT, lint
from tmcm34x.toolchain.parser import SourceLine, parse_line


class Files(Protocol):
    """The files that are not open."""

    def read(self, name: str, /) -> str:
        """The text of a file; raises `OSError` or `ValueError` where there is none."""
        ...

    def names(self, folder: str, /) -> Sequence[str]:
        """The names of the files in a folder; none where it cannot be read."""
        ...


_LONG_LINE: Final = 400
_CACHED_LINES: Final = 32768
"""More than the lines of any program, so that none is parsed again while another one is changed."""

_remembered = lru_cache(maxsize=_CACHED_LINES)(parse_line)


def parse_again(text: str) -> SourceLine:
    """`parse_line` for texts that come again with one line changed."""
    return _remembered(text) if len(text) < _LONG_LINE else parse_line(text)


class Workspace:
    """Open files by name, and the analyses of the programs that they are or belong to.

    files: those that are not open
    include_path: folders where those are looked for, after the folder of the including file
    """

    def __init__(self, files: Files, include_path: Sequence[str] = (), model: int = 343) -> None:
        self.files = files
        self.include_path = list(include_path)
        self.model = model
        self.rules = DEFAULT
        """The linter's rules that are on."""
        self.texts: dict[str, str] = {}
        self._programs: dict[str, Analysis] = {}
        self._owners: dict[str, str] = {}
        """The program on disk to which each open file belongs."""

    def put(self, name: str, text: str) -> None:
        """Opens a file, or gives it a new text."""
        self.texts[name] = text
        self._forget(name)

    def close(self, name: str) -> None:
        """From now on the file on disk counts again."""
        self.texts.pop(name, None)
        self._forget(name)

    def set_model(self, model: int) -> None:
        """The module that programs are for."""
        if model != self.model:
            self.model = model
            self._programs.clear()

    def set_rules(self, rules: frozenset[str]) -> None:
        """The linter's rules that are on."""
        if rules != self.rules:
            self.rules = rules
            self._programs.clear()

    def refresh(self) -> None:
        """Forgets everything read from disk."""
        self._programs.clear()
        self._owners.clear()

    def analysis(self, name: str) -> Analysis:
        """The program that an open file is, or that it belongs to."""
        for root in self.texts:
            if root != name and name in self._program(root).assembly.sources:
                return self._program(root)
        return self._program(self._owner(name))

    def _owner(self, name: str) -> str:
        """The program in the folder that includes `name`; `name` itself where none does."""
        if name not in self._owners:
            folder, base = posixpath.split(name)
            names = [
                other for other in self.files.names(folder) if posixpath.splitext(other)[1].lower() in SOURCES
            ]
            programs: Iterator[str] = iter(())
            if len(names) <= MOST_NEIGHBOURS:
                programs = programs_with(base, names, lambda other: self._text(posixpath.join(folder, other)))
            self._owners[name] = posixpath.join(folder, next(programs, base))
        owner = self._owners[name]
        return owner if owner == name or name in self._program(owner).assembly.sources else name

    def _text(self, name: str) -> str:
        return self.texts[name] if name in self.texts else self.files.read(name)

    def together(self, name: str) -> list[str]:
        """The open files whose findings may change when `name` does: all of its programs."""
        return [other for other in self.texts if name in self._program(other).assembly.sources] + [
            other
            for other in self._program(name).assembly.sources
            if other in self.texts and name not in self._program(other).assembly.sources
        ]

    def _program(self, name: str) -> Analysis:
        program = self._programs.get(name)
        if program is None:
            assembly = assemble(
                self._own_text(name),
                name,
                self._include,
                append_stop=True,
                parse=parse_again,
                model=self.model,
            )
            found = lint(assembly, model=self.model, rules=self.rules)
            program = self._programs[name] = Analysis(assembly, found, self.model)
        return program

    def _own_text(self, name: str) -> str:
        try:
            return self._text(name)
        except (OSError, ValueError):
            return ""

    def _forget(self, name: str) -> None:
        """Drops the programs that `name` is part of, or might become part of."""
        stale = [
            root
            for root, program in self._programs.items()
            if root == name
            or name in program.assembly.sources
            or any(item.code == "E501" for item in program.assembly.diagnostics)
        ]
        for root in stale:
            del self._programs[root]

    def _include(self, name: str, including: str) -> tuple[str, str]:
        name = name.replace("\\", "/")
        places = [
            posixpath.normpath(posixpath.join(folder, name))
            for folder in (posixpath.dirname(including), *self.include_path)
        ]
        for place in places:
            if place in self.texts:
                return place, self.texts[place]
        for place in places[:-1]:  # an exception kept for later would keep the whole analysis alive
            with suppress(OSError, ValueError):
                return self._fitting(place)
        return self._fitting(places[-1])

    def _fitting(self, place: str) -> tuple[str, str]:
        """Name and text of a file; raises `OSError` or `ValueError` where it cannot be read."""
        folder, base = posixpath.split(place)
        found = posixpath.join(folder, fitting(base, self.files.names(folder)) or base)
        return found, self._text(found)
