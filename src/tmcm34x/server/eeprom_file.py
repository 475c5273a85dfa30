"""The file that holds a module's non-volatile memory: an image, and a journal behind it; used by one process.

Changes are appended (`append`) by one write.  A new image without a journal replaces the file in one step: it is
written beside it, synchronised, locked and renamed over it, so that the path names a complete memory at any moment,
old or new.  The lock belongs to the file itself, so nothing else is left lying about; a process that has locked a file
which was replaced meanwhile tries again.

The new file has a random name and is created by us or not at all: a link that lies there already is not followed.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
import sys
from pathlib import Path
from typing import Final, NamedTuple

from tmcm34x.files import followed
from tmcm34x.server.file_lock import lock

_NO_FD: Final = -1
_OPEN: Final = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0)
_CREATE: Final = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | _OPEN
_SUFFIX: Final = ".new"


class EepromFileError(Exception):
    """A file that cannot be used; the text is one clear line."""


class NewFile(NamedTuple):
    """A file that is to replace the old one."""

    fd: int
    path: Path

    def discard(self) -> None:
        """Remove it."""
        os.close(self.fd)
        self.path.unlink()


class EepromFile:
    """The file at `path`, locked for this process until `close`.

    Raises `EepromFileError` if it is in use, cannot be read and written, or could not be replaced later.
    """

    def __init__(self, path: str | Path) -> None:
        self._shown = str(path)
        self._fd = _NO_FD
        self._size = 0
        try:
            self._path = followed(path)
            self._fd = self._open()
            if not os.access(self._path.parent, os.W_OK):
                raise PermissionError(0, f"cannot write to the folder {self._path.parent}")
            self._remove_left_overs()
        except OSError as error:
            self.close()
            raise self._error(error) from error

    def load(self) -> bytes | None:
        """Image and journal, or None where there is no file yet."""
        if self._fd == _NO_FD:
            return None
        try:
            os.lseek(self._fd, 0, os.SEEK_SET)
            data = b""
            while chunk := os.read(self._fd, 1 << 20):
                data += chunk
        except OSError as error:
            raise self._error(error) from error
        self._size = len(data)
        return data

    def append(self, entries: bytes) -> None:
        """Append to the journal; raises `EepromFileError` and leaves the file as it was if that does not work."""
        try:
            written = os.write(self._fd, entries)
            if written != len(entries):
                raise OSError(0, "the disk is full")
        except OSError as error:
            with contextlib.suppress(OSError):
                os.truncate(self._fd, self._size)
                os.lseek(self._fd, self._size, os.SEEK_SET)
            raise self._error(error) from error
        self._size += written

    def synchronise(self, *, folder: bool = True) -> None:
        """Have the operating system write the file to the disk, and its name.  Raises `EepromFileError`."""
        try:
            os.fsync(self._fd)
            if folder:
                _synchronise_folder(self._path.parent)
        except OSError as error:
            raise self._error(error) from error

    def prepare(self, image: bytes) -> NewFile:
        """A new file with `image`, complete, on the disk, and locked.  Raises `EepromFileError`."""
        path = self._path.with_name(f".{self._path.name}.{secrets.token_hex(8)}{_SUFFIX}")
        try:
            mode = 0o666 if self._fd == _NO_FD else os.fstat(self._fd).st_mode & 0o777
            new = NewFile(os.open(path, _CREATE, mode), path)
        except OSError as error:
            raise self._error(error) from error
        try:
            lock(new.fd)
            _write(new.fd, image)
            if self._fd != _NO_FD:
                path.chmod(mode)
            os.fsync(new.fd)
        except OSError as error:
            with contextlib.suppress(OSError):
                new.discard()
            raise self._error(error) from error
        return new

    def publish(self, new: NewFile, journal: bytes = b"") -> None:
        """Replace the file by a new one with a journal behind its image.  Raises `EepromFileError`.

        The first file must not replace one that another process has created meanwhile.
        """
        try:
            _write(new.fd, journal)
            fd = self._create(new) if self._fd == _NO_FD else self._replace(new)
        except OSError as error:
            with contextlib.suppress(OSError):
                new.discard()
            raise self._error(error) from error
        self.close()
        self._fd = fd
        self._size = os.lseek(fd, 0, os.SEEK_END)

    def save(self, image: bytes) -> None:
        """Replace the file by one with `image`; raises `EepromFileError` and leaves the old one if that fails."""
        self.publish(self.prepare(image))
        self.synchronise()

    def close(self) -> None:
        """Give the file free for others."""
        if self._fd != _NO_FD:
            os.close(self._fd)
            self._fd = _NO_FD

    def _error(self, error: OSError) -> EepromFileError:
        return EepromFileError(f"{self._shown}: {error.strerror or error}")

    def _open(self) -> int:
        while True:
            try:
                fd = os.open(self._path, os.O_RDWR | _OPEN)
            except FileNotFoundError:
                return _NO_FD
            try:
                if not stat.S_ISREG(os.fstat(fd).st_mode):
                    raise OSError(0, "not a file")
                lock(fd)
                if os.path.samestat(os.fstat(fd), self._path.stat()):
                    return fd
            except FileNotFoundError:
                pass
            except BlockingIOError as error:
                os.close(fd)
                raise OSError(error.errno, "in use by another process") from error
            except OSError:
                os.close(fd)
                raise
            os.close(fd)

    def _create(self, new: NewFile) -> int:
        self._path.hardlink_to(new.path)
        new.path.unlink()
        return new.fd

    def _replace(self, new: NewFile) -> int:
        if sys.platform != "win32":
            new.path.rename(self._path)
            return new.fd
        self.close()  # Windows replaces no open file, and by no open one
        os.close(new.fd)
        new.path.replace(self._path)
        return self._open()

    def _remove_left_overs(self) -> None:
        """Remove new files of processes that were killed; they would have had them locked."""
        if self._fd == _NO_FD:
            return
        for path in self._path.parent.glob(f".{_literal(self._path.name)}.*{_SUFFIX}"):
            with contextlib.suppress(OSError):
                fd = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | _OPEN)
                try:
                    lock(fd)
                    path.unlink()
                finally:
                    os.close(fd)


def _literal(name: str) -> str:
    return "".join(f"[{character}]" if character in "*?[" else character for character in name)


def _write(fd: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(fd, view) :]


def _synchronise_folder(folder: Path) -> None:
    if sys.platform == "win32":  # where folders cannot be opened
        return
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
