"""Searches of the debugger along the past: in another thread, one at a time, while the loop serves lines and pages."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tmcm34x.debug.sessions.search import PlaybackSearch

Again = Callable[[], Awaitable["PlaybackSearch | None"]]
"""Makes a request again; the search that has to run first, if there is still one."""


class Searching:
    """Runs searches for requests that wait for them."""

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None

    def go_on(self, search: PlaybackSearch, again: Again, give_up: Callable[[], None]) -> None:
        """Run `search` behind the present one, and make the request again; `give_up` where it was cancelled."""
        self._task = asyncio.create_task(_go_on(self._task, search, again, give_up))


async def _go_on(
    previous: asyncio.Task[None] | None,
    search: PlaybackSearch | None,
    again: Again,
    give_up: Callable[[], None],
) -> None:
    if previous is not None:
        await asyncio.wait([previous])
    done: list[PlaybackSearch] = []
    while search is not None:
        await _run(search)
        if search.cancelled:
            give_up()
            break
        search.keep()
        done.append(search)
        search = await again()
    for each in done:
        each.forget()


async def _run(search: PlaybackSearch) -> None:
    if search.cancelled:
        return
    search.begin()
    try:
        await asyncio.to_thread(search.run)
    except asyncio.CancelledError:
        search.cancel()
        raise
