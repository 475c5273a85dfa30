"""Files of users: where paths lead, bounded reading, and TOML that is a table or an error, whatever the text."""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, Final

ENDLESS_LIMIT: Final = 64 << 20
"""Bytes that are read at most of what has no size: a pipe or a device."""
_DEEP_KEY: Final = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){64}""")
"""A dotted key so deep that the standard library takes seconds or gigabytes for it."""


def real_path(path: str | Path) -> Path:
    """The one name of a file, for each way to it: absolute and without links; there need be no file.

    A link that leads in a circle stays in the name.  Raises `ValueError` for a name with a NUL.
    """
    return Path(os.path.realpath(path))


def followed(path: str | Path) -> Path:
    """Where opening or creating the file of a path leads: its `real_path`, in which no link is left.

    Raises `OSError` for links in a circle, because the system does not look behind one: `circle/../other` is no way to
    `other`, which may be a link itself.  Raises `ValueError` for a name with a NUL.
    """
    found = real_path(path)
    if any(os.path.islink(part) for part in (found, *found.parents)):  # noqa: PTH114 - too long a name is no link
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    return found


def read_bytes(path: Path) -> bytes:
    """The contents of a file, or of a pipe or device that ends.  Raises `OSError`."""
    if "\0" in str(path):
        raise OSError(errno.EINVAL, "no name of a file", str(path))
    with path.open("rb") as stream:
        if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            return stream.read()
        data = stream.read(ENDLESS_LIMIT + 1)
    if len(data) > ENDLESS_LIMIT:
        raise OSError(errno.EFBIG, f"more than {ENDLESS_LIMIT >> 20} MB, and no regular file")
    return data


def read_text(path: Path) -> str:
    """The text of a file in UTF-8, with its line ends as LF.  Raises `OSError` or `UnicodeDecodeError`."""
    return read_bytes(path).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def parse_toml(text: str) -> dict[str, Any]:
    """The table of a TOML text.  Raises `tomllib.TOMLDecodeError`, also for what is too deep or a number too long."""
    if _DEEP_KEY.search(text):
        raise tomllib.TOMLDecodeError("a dotted key with more than 64 parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise tomllib.TOMLDecodeError("nested too deeply") from None
    except ValueError:
        raise tomllib.TOMLDecodeError("a number with too many digits") from None
