"""A recording of a server's lines, with the clocks at which telegrams passed."""

from __future__ import annotations

from tmcm34x.capture.files import RecordingWriter
from tmcm34x.capture.record import NS, from_sink
from tmcm34x.clock import HZ
from tmcm34x.server.telegram_log import Sink
from tmcm34x.tmcl.telegrams import Direction, Kind


class Tap:
    """A sink of a server that records; `also` gets the telegrams too."""

    def __init__(self, recorder: RecordingWriter, also: Sink | None = None) -> None:
        self._recorder = recorder
        self.also = also

    def write(self, now: float, name: str, direction: Direction, data: bytes, kind: Kind) -> None:
        """Record one."""
        self._recorder.add(from_sink(round(now * NS / HZ), name, direction, data, kind))
        if self.also is not None:
            self.also.write(now, name, direction, data, kind)
