"""What the server does for a window in more than one command: see `authority`."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from tmcm34x.ide import wire
    from tmcm34x.ide.window import Window

JOG_PATIENCE_S: Final = 1.0
"""How long a motor turns without a word about its arrow."""
PATIENCE_S: Final = 3.0
"""How long any other motion goes on without a word from its window."""


@dataclass(eq=False)
class MotionUnderWay:
    """Something under way for the window `owner`."""

    number: int
    kind: wire.MotionKind
    owner: Window
    motors: frozenset[int]
    heard_s: float
    velocity: int = 0
    task: asyncio.Task[None] | None = field(default=None, repr=False)

    @property
    def patience_s(self) -> float:
        """How long it goes on in silence."""
        return JOG_PATIENCE_S if self.kind == "jog" else PATIENCE_S

    def last_word_s(self) -> float:
        """When its window last said that it goes on."""
        return self.heard_s if self.kind == "jog" else self.owner.heard_s
