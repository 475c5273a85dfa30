"""Bugs of the server: logged with their traceback, and shown in the page as errors of the program."""

from __future__ import annotations

import logging
from typing import Final

from tmcm34x.ide import wire

_log: Final = logging.getLogger(__name__)


def fault(error: Exception, where: str, number: int = 0) -> wire.Fault:
    """What pages are sent about an exception that only a bug explains, which is logged here.

    number: of the call that met it
    """
    _log.error("in %s", where, exc_info=error)
    return wire.Fault(
        number, f"An error in the IDE itself ({where}): {error!r}. The server's log has the details."
    )
