"""The file that holds a module's non-volatile memory: replaced in one step, used by one process.

At any moment the path names a complete image, old or new: a new one is written beside it, synchronised, locked
and renamed over it.  The lock (`flock`) belongs to the image itself, so nothing else is left lying about; a
process that has locked an image which was replaced meanwhile tries again.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Final

_NO_FD: Final = -1


class EepromFileError(Exception):
    """An image file that cannot be used; the text is one clear line."""


class EepromFile:
    """The image at `path`, locked for this process until `close`.

    Raises `EepromFileError` if it is in use, cannot be read, or could not be replaced later.
    """

    def __init__(self, path: str | Path) -> None:
        self._shown = str(path)
        self._path = Path(path).resolve()
        self._temporary = self._path.with_name(f".{self._path.name}.new")
        self._fd = _NO_FD
        try:
            self._fd = self._open()
            if not os.access(self._path.parent, os.W_OK):
                raise PermissionError(0, f"cannot write to the folder {self._path.parent}")
        except OSError as error:
            self.close()
            raise EepromFileError(f"{self._shown}: {error.strerror}") from error

    def load(self) -> bytes | None:
        """The image, or None where there is no file yet."""
        if self._fd == _NO_FD:
            return None
        try:
            return os.pread(self._fd, os.fstat(self._fd).st_size, 0)
        except OSError as error:
            raise EepromFileError(f"{self._shown}: {error.strerror}") from error

    def save(self, image: bytes) -> None:
        """Replace the image; raises `EepromFileError` and leaves the old one if that does not work."""
        try:
            fd = self._write(image)
            try:
                self._publish()
            except OSError:
                os.close(fd)
                raise
        except OSError as error:
            raise EepromFileError(f"{self._shown}: {error.strerror}") from error
        self.close()
        self._fd = fd

    def close(self) -> None:
        """Give the image free for others."""
        if self._fd != _NO_FD:
            os.close(self._fd)
            self._fd = _NO_FD

    def _open(self) -> int:
        while True:
            try:
                fd = os.open(self._path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
            except FileNotFoundError:
                return _NO_FD
            try:
                fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.path.samestat(os.fstat(fd), self._path.stat()):
                    return fd
            except BlockingIOError as error:
                os.close(fd)
                raise OSError(error.errno, "in use by another process") from error
            except FileNotFoundError:
                pass
            os.close(fd)

    def _write(self, image: bytes) -> int:
        """A new file beside the old one, complete, on the disk, and locked."""
        mode = 0o666 if self._fd == _NO_FD else os.fstat(self._fd).st_mode & 0o777
        fd = os.open(self._temporary, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, mode)
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(fd, 0)
            view = memoryview(image)
            while view:
                view = view[os.write(fd, view) :]
            os.fsync(fd)
        except OSError:
            os.close(fd)
            raise
        return fd

    def _publish(self) -> None:
        """Give the new file the image's name; the first image must not replace somebody else's."""
        if self._fd == _NO_FD:
            self._path.hardlink_to(self._temporary)
            self._temporary.unlink()
        else:
            self._temporary.rename(self._path)
        _synchronise(self._path.parent)


def _synchronise(folder: Path) -> None:
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
