"""Files of coverage: an lcov tracefile, and the HTML page beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tmcm34x import files
from tmcm34x.editor import disk
from tmcm34x.toolchain.tokens import split_lines
from tmcm34x.trace.coverage import Coverage, format_html, format_lcov, parse_lcov


def page_beside(path: Path) -> Path:
    """The page of a tracefile."""
    return path.with_suffix(".html")


def read_tracefile(path: Path) -> Coverage:
    """What a tracefile counts; nothing where there is none.

    Raises `CoverageError`, `UnicodeDecodeError`, `OSError`.
    """
    return parse_lcov(files.read_text(path)) if path.exists() else {}


def write_tracefile(
    path: Path, coverage: Coverage, root: Path, sources: Mapping[str, list[str]] | None = None
) -> None:
    """Write a tracefile, and the page beside it.  Raises `OSError`.

    root: the folder from which the files are named
    sources: the lines of files that are known; the others are read
    """
    names = dict.fromkeys(name for name, _ in coverage)
    texts = {**{name: _source(root / name) for name in names}, **(sources or {})}
    path.write_text(format_lcov(coverage), encoding="utf-8", newline="\n")
    page_beside(path).write_text(format_html(coverage, texts), encoding="utf-8", newline="\n")


def _source(path: Path) -> list[str]:
    """The lines of a source; none where it cannot be read, such as those of standard input."""
    try:
        return split_lines(disk.read_text(path))
    except (OSError, ValueError):
        return []
