"""Standard output and error output of commands that serve: whoever does not read them holds up no server."""

from __future__ import annotations

import contextlib
import errno
import logging
from collections.abc import Callable, Generator
from typing import Any, Final

from tmcm34x.server.output import OutputLines

OUTPUT: Final = OutputLines(1)
ERRORS: Final = OutputLines(2)


class _Records(logging.Handler):
    """What libraries log of faults."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write it some time soon."""
        ERRORS.write(f"{self.format(record)}\n")


@contextlib.contextmanager
def logging_here() -> Generator[None]:
    """Have libraries log through here: by themselves they write to the error output and wait for its reader."""
    handler = _Records(logging.ERROR)
    logging.getLogger().addHandler(handler)
    try:
        yield
    finally:
        logging.getLogger().removeHandler(handler)
        ERRORS.close()


class Scarcity:
    """Says once, by `report`, what keeps a server from accepting connections; asyncio tries again after a second."""

    def __init__(self, report: Callable[[str], object]) -> None:
        self._report = report
        self._reported: set[str] = set()

    def covers(self, context: dict[str, Any]) -> bool:
        """Whether what an event loop passes to its exception handler is of this kind."""
        error = context.get("exception")
        if not (isinstance(error, OSError) and error.errno in _SCARCE and "socket" in context):
            return False
        line = f"connections are not accepted at times: {error.strerror}"
        if line not in self._reported:
            self._reported.add(line)
            self._report(line)
        return True


_SCARCE: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM, errno.ECONNABORTED})
