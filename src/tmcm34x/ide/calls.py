"""What does each call of a page: one table over all parts that have some."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.ide import (
    bench_calls,
    benches,
    command_calls,
    folder,
    past_calls,
    program_calls,
    study,
    switching,
    wire,
)
from tmcm34x.ide.motions import BEGIN
from tmcm34x.ide.present import expect_present

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window

_OF_HUB: Final = (command_calls, program_calls, bench_calls, study, past_calls, benches)


class _Method(NamedTuple):
    """A function of an owner, a window and a call, and what of a hub is its owner."""

    owner: Callable[[Hub], Any]
    do: Callable[..., Awaitable[object]]


def _itself(hub: Hub) -> Hub:
    return hub


METHODS: Final[Mapping[type[wire.Call], _Method]] = {
    **{call: _Method(_itself, do) for part in _OF_HUB for call, do in part.METHODS.items()},
    **{call: _Method(attrgetter("folder"), do) for call, do in folder.METHODS.items()},
    **{call: _Method(attrgetter("switching"), do) for call, do in switching.METHODS.items()},
}
"""Every call but those of `motions.BEGIN`."""


async def answer(hub: Hub, page: Window, call: wire.Call) -> object:
    """Do what a window asks for.  Raises `wire.RefusalError`."""
    expect_present(hub.target, call)
    begin = BEGIN.get(type(call))
    if begin is None:
        owner, do = METHODS[type(call)]
        return await do(owner(hub), page, call)
    hub.expect_idle()
    return await begin(hub.authority, hub.tell, page, call)
