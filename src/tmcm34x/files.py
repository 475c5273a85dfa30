"""Files of users: bounded reading, and TOML that no text can turn into anything but a table or an error."""

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


def read_bytes(path: Path) -> bytes:
    """The contents of a file, or of a pipe or device that ends.  Raises `OSError`."""
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
