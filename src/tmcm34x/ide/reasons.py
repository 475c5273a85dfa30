"""Why a motor does not turn, by the host library, for pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tmcm34x.host import why
from tmcm34x.host.exceptions import HostError
from tmcm34x.ide import wire
from tmcm34x.ide.driving import run
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target


async def explain(target: Target, motor: int) -> wire.Reasons:
    """What keeps a motor still, and which values are not known.  Raises `wire.RefusalError`."""
    if not 0 <= motor < MOTORS:
        raise wire.RefusalError("range", f"Motors are 0..{MOTORS - 1}.")
    try:
        facts = await run(target.ask, why.read(motor, target.model.number))
    except HostError as error:
        raise wire.RefusalError("module", f"{error}.") from error
    return wire.Reasons([reason.line for reason in why.reasons(facts)], why.unknown(facts))
