"""What happened on a line, as numbers."""

from __future__ import annotations


class WireCounts:
    """What happened on a line since it was opened."""

    __slots__ = ("events", "garbled", "late", "misdirected", "retried", "sent")

    def __init__(self) -> None:
        self.sent = 0
        self.retried = 0
        """Telegrams sent again."""
        self.late = 0
        """Replies to commands that had been given up."""
        self.garbled = 0
        """Times that bytes came which were no reply."""
        self.misdirected = 0
        """Whole replies to commands that were never sent: another host is on the line."""
        self.events = 0
