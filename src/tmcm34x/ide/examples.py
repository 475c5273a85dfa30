"""The examples that come with the package: programs, with what they include and the bench that each is for.

What a program is, its first comment says: a title, behind a colon or in the next paragraph an explanation, and behind
`Try:` the bench that it is run with.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Final

from tmcm34x.files import parse_toml, read_text
from tmcm34x.ide import wire
from tmcm34x.ide.workspace import OpenFolder

_PACKED: Final = files("tmcm34x") / "examples"
_SOURCE: Final = Path(__file__).parents[3] / "examples"
_BENCH: Final = re.compile(r"--bench examples/(benches/[\w.-]+\.toml)")
_INCLUDE: Final = re.compile(r"^\s*#include\s+(\S+)", re.MULTILINE)
_PROGRAMS: Final = ("*.tmc", "manual/*.tmc")


def folder() -> Path:
    """Where the examples are: in the package, or in the source tree that runs in place."""
    packed = Path(str(_PACKED))
    return packed if packed.is_dir() else _SOURCE


def listed() -> wire.Examples:
    """All programs and benches; none where the package came without them."""
    root = folder()
    programs = [_program(root, path) for pattern in _PROGRAMS for path in sorted(root.glob(pattern))]
    benches = [
        wire.BenchShape(_name(root, path), _title(path)) for path in sorted(root.glob("benches/*.toml"))
    ]
    return wire.Examples(programs, benches)


def text(name: str) -> str:
    """The text of one file of the examples.  Raises `wire.RefusalError`."""
    examples = OpenFolder(folder(), frozenset({".tmc", ".toml"}))
    if name not in [entry.path for entry in examples.files()]:
        raise wire.RefusalError("path", f"There is no example {name}.")
    return read_text(examples.resolve(name))


def _name(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()


def _program(root: Path, path: Path) -> wire.ExampleShape:
    source = read_text(path)
    first, _, rest = "\n".join(_comment(source)).partition("\n\n")
    title, _, more = first.replace("\n", " ").partition(_divider(first))
    bench = _BENCH.search(source)
    return wire.ExampleShape(
        path=_name(root, path),
        title=title.rstrip("."),
        text=_sentence(more.strip() or rest.partition("Try:")[0]),
        bench=bench[1] if bench else "",
        includes=_INCLUDE.findall(source),
    )


def _divider(first: str) -> str:
    """What stands between title and explanation."""
    return next((mark for mark in (": ", "; ") if mark in first), "\n")


def _comment(source: str) -> Iterator[str]:
    """The lines of the comment at the head of a program."""
    for line in source.splitlines():
        if not line.startswith("//"):
            return
        yield line.removeprefix("//").strip()


def _sentence(words: str) -> str:
    """The first sentence, as one."""
    first = " ".join(words.split()).partition(". ")[0].rstrip(".")
    return f"{first[:1].upper()}{first[1:]}." if first else ""


def _title(path: Path) -> str:
    return str(parse_toml(read_text(path)).get("title", path.stem))
