"""A reader of waveform files by others."""

import signal

_BROKEN_PIPE = signal.getsignal(signal.SIGPIPE)

from vcdvcd import VCDVCD  # noqa: E402

# The import has a broken pipe end the whole process, as suits a command and not a test run.
signal.signal(signal.SIGPIPE, _BROKEN_PIPE)

__all__ = ["VCDVCD"]
