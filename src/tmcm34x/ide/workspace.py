"""The opened folder: the only files that a page may see.

A path is relative to the folder, with `/` between its parts.  Paths that lead outside, by `..` or by a symbolic
link, are refused.  A text is saved in the encoding in which it was, a new one in UTF-8; lines end in LF or CR LF.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from tmcm34x.files import followed
from tmcm34x.ide.wire import FileEntry, FileText, RefusalError
from tmcm34x.toolchain.encoding import UTF_8, Encoding, EncodingError, decode, encode

SUFFIXES: Final = frozenset({".tmc", ".inc", ".tml", ".txt", ".toml", ".md", ".csv", ".h"})
"""Files that are shown and may be opened; programs and what lies beside them."""
MAX_BYTES: Final = 4 << 20
"""Longest file that an editor should show."""
MAX_ENTRIES: Final = 2000
MAX_DEPTH: Final = 6
_HIDDEN: Final = frozenset({"node_modules", "__pycache__"})
OVERWRITE: Final = "*"


class OpenFolder:
    """A folder."""

    def __init__(self, folder: Path, suffixes: frozenset[str] = SUFFIXES) -> None:
        self.folder = followed(folder)
        self._suffixes = suffixes

    @classmethod
    def of(cls, paths: Sequence[Path]) -> tuple[OpenFolder, list[str]]:
        """The workspace for what the user named, and which files to show first."""
        if len(paths) == 1 and paths[0].is_dir():
            return cls(paths[0]), []
        files = [followed(path) for path in paths if not path.is_dir()]
        folders = [path.parent for path in files] + [followed(path) for path in paths if path.is_dir()]
        named = frozenset(path.suffix.lower() for path in files)
        workspace = cls(Path(os.path.commonpath(folders)) if folders else Path.cwd(), SUFFIXES | named)
        return workspace, [path.relative_to(workspace.folder).as_posix() for path in files]

    def resolve(self, path: str) -> Path:
        """The file that `path` names; refuses to leave the folder."""
        if not path or "\0" in path or path.startswith(("/", "\\")):
            raise RefusalError("path", f"{path!r} is not a path inside the opened folder.")
        try:
            found = followed(self.folder / path)
        except OSError as error:
            raise RefusalError("path", f"{path[:100]!r} leads nowhere.") from error
        if not found.is_relative_to(self.folder) or found == self.folder:
            raise RefusalError("path", f"{path} leads out of the opened folder.")
        return found

    def name(self, path: Path) -> str:
        """How pages call a file inside the folder."""
        return path.relative_to(self.folder).as_posix()

    def names(self, folder: str) -> list[str]:
        """The names of the files in a folder inside the opened one; none where it cannot be read."""
        try:
            found = followed(self.folder / folder)
            if not found.is_relative_to(self.folder):
                return []
            return sorted(path.name for path in found.iterdir() if path.is_file())
        except (OSError, ValueError):
            return []

    def files(self) -> list[FileEntry]:
        """Folders and files, in the order of a tree."""
        entries: list[FileEntry] = []
        self._walk(self.folder, "", entries)
        return entries

    def _walk(self, folder: Path, prefix: str, entries: list[FileEntry]) -> None:
        try:
            found = sorted(os.scandir(folder), key=lambda entry: (entry.is_dir(), entry.name.lower()))
        except OSError:
            return
        for entry in found:
            if len(entries) >= MAX_ENTRIES:
                return
            path = prefix + entry.name
            if entry.is_dir(follow_symlinks=False):
                if entry.name.startswith(".") or entry.name in _HIDDEN or path.count("/") >= MAX_DEPTH:
                    continue
                before = len(entries)
                entries.append(FileEntry(path, True, 0, ""))
                self._walk(Path(entry.path), path + "/", entries)
                if len(entries) == before + 1:
                    entries.pop()
            elif Path(entry.name).suffix.lower() in self._suffixes and not entry.name.startswith("."):
                try:
                    entries.append(_entry(path, entry.stat()))
                except OSError:
                    continue

    def read(self, path: str) -> FileText:
        """The text of a file."""
        file = self.resolve(path)
        try:
            status = file.stat()
            if not stat.S_ISREG(status.st_mode):
                raise RefusalError("kind", f"{path} is not a file.")
            if status.st_size > MAX_BYTES:
                raise RefusalError("size", f"{path} has {status.st_size >> 20} MB: too long to edit here.")
            text, _ = decode(file.read_bytes())
        except OSError as error:
            raise RefusalError("file", f"{path}: {error.strerror}") from error
        except EncodingError as error:
            raise RefusalError("kind", f"{path}: {error}.") from error
        newline: Literal["\n", "\r\n"] = "\r\n" if "\r\n" in text else "\n"
        return FileText(path, text.replace("\r\n", "\n"), _entry(path, status).stamp, newline)

    def write(self, path: str, text: str, stamp: str, newline: str) -> FileEntry:
        """Save a text, whole or not at all, encoded as the file was.

        Refuses when the file is no longer the one of `stamp`, and a text that its encoding cannot hold.
        """
        file = self.resolve(path)
        self._expect_suffix(file, path)
        try:
            if file.exists() and not stat.S_ISREG(file.stat().st_mode):
                raise RefusalError("kind", f"{path} is not a file.")
            data = _encoded(text.replace("\r\n", "\n").replace("\n", newline), _encoding(file), path)
            if len(data) > MAX_BYTES:
                raise RefusalError("size", f"{path} would be too long.")
            if stamp != OVERWRITE and self._stamp(file) != stamp:
                raise RefusalError("changed", f"{path} was changed outside.")
            file.parent.mkdir(parents=True, exist_ok=True)
            if file.exists() and not os.access(file, os.W_OK):
                raise RefusalError("file", f"{path} is read-only.")
            _replace(file, data)
            return _entry(path, file.stat())
        except OSError as error:
            raise RefusalError("file", f"{path}: {error.strerror}") from error

    def rename(self, path: str, to: str) -> None:
        """Give a file another path."""
        file, other = self.resolve(path), self.resolve(to)
        self._expect_suffix(other, to)
        try:
            if other.exists():
                raise RefusalError("exists", f"{to} is there already.")
            other.parent.mkdir(parents=True, exist_ok=True)
            file.rename(other)
        except OSError as error:
            raise RefusalError("file", f"{path}: {error.strerror}") from error

    def _expect_suffix(self, file: Path, path: str) -> None:
        if file.suffix.lower() not in self._suffixes:
            raise RefusalError("kind", f"{path}: a name here ends in {', '.join(sorted(self._suffixes))}.")

    def delete(self, path: str) -> None:
        """Remove a file."""
        try:
            self.resolve(path).unlink()
        except OSError as error:
            raise RefusalError("file", f"{path}: {error.strerror}") from error

    def _stamp(self, file: Path) -> str:
        try:
            return _entry("", file.stat()).stamp
        except FileNotFoundError:
            return ""


def _encoding(file: Path) -> Encoding:
    """How a file is stored; UTF-8 where there is none, or none that is a text."""
    try:
        return decode(file.read_bytes())[1]
    except (FileNotFoundError, EncodingError):
        return UTF_8


def _encoded(text: str, encoding: Encoding, path: str) -> bytes:
    try:
        return encode(text, encoding)
    except EncodingError as error:
        cure = "" if encoding.codec == UTF_8.codec else "; replace it, or convert the file to UTF-8 first"
        raise RefusalError("encoding", f"{path} is not saved: {error}{cure}.") from error


def _entry(path: str, status: os.stat_result) -> FileEntry:
    return FileEntry(path, False, status.st_size, f"{status.st_mtime_ns:x}-{status.st_size:x}")


def _replace(file: Path, data: bytes) -> None:
    """Write beside the file, then put it in its place, with the permissions it had."""
    mode = stat.S_IMODE(file.stat().st_mode) if file.exists() else 0o644
    descriptor, name = tempfile.mkstemp(dir=file.parent, prefix=".", suffix=".part")
    beside = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        beside.chmod(mode)
        beside.replace(file)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
