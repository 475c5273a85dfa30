"""What a window may have under way: for each call, what is checked and what begins."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.host import commands, motion
from tmcm34x.host.load_profile import LoadReading, measure
from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.host.settings import KEPT, keep
from tmcm34x.host.steps import Pause, Steps
from tmcm34x.ide import wire
from tmcm34x.ide.under_way import PATIENCE_S
from tmcm34x.tmcl.axis_parameters import BY_NUMBER as AXIS_BY_NUMBER
from tmcm34x.tmcl.commands import COORDINATES, MOTORS, POSITION_MAX
from tmcm34x.tmcl.global_parameters import BY_NUMBER as GLOBAL_BY_NUMBER

if TYPE_CHECKING:
    from tmcm34x.ide.authority import Authority
    from tmcm34x.ide.target import Tell
    from tmcm34x.ide.window import Window

TOP_SPEED: Final = 2047
_NAMED: Final = 3
"""Parameters that a summary names; the others it counts."""


def _expect(motors: Sequence[int], *velocities: int) -> None:
    """Refuse what no motor can do."""
    if any(not 0 <= motor < MOTORS for motor in motors) or any(abs(v) > TOP_SPEED for v in velocities):
        raise wire.RefusalError("range", f"Motors are 0..{MOTORS - 1}, velocities 0..{TOP_SPEED}.")


async def _jog(authority: Authority, tell: Tell, page: Window, call: wire.Jog) -> None:
    _expect([call.motor], call.velocity)
    await authority.jog(page, call.motor, call.velocity)


async def _stride(authority: Authority, tell: Tell, page: Window, call: wire.Stride) -> None:
    _expect([call.motor])
    if abs(call.distance) > POSITION_MAX:
        raise wire.RefusalError("range", f"A step has {POSITION_MAX} microsteps at most.")
    authority.permit_motion({call.motor})
    await authority.strides.step(call.motor, call.distance)


async def _zero(authority: Authority, tell: Tell, page: Window, call: wire.Zero) -> int:
    _expect([call.motor])
    end = f"Motor {call.motor} is at rest; its position is 0 now."
    return authority.begin("zero", page, {call.motor}, motion.zero(call.motor), end)


async def _search(authority: Authority, tell: Tell, page: Window, call: wire.Search) -> int:
    _expect([call.motor])
    end = f"The reference search of motor {call.motor} has ended."
    return authority.begin("search", page, {call.motor}, motion.find_reference(call.motor), end)


async def _go(authority: Authority, tell: Tell, page: Window, call: wire.Go) -> int:
    _expect(call.motors)
    if not call.motors or not 0 <= call.coordinate < COORDINATES:
        raise wire.RefusalError("range", f"Coordinates are 0..{COORDINATES - 1}, for one motor or more.")
    steps = motion.go(call.motors, call.coordinate)
    return authority.begin("go", page, call.motors, steps, f"At coordinate {call.coordinate}.")


async def _turn(authority: Authority, tell: Tell, page: Window, call: wire.Turn) -> int:
    _expect([call.motor], call.velocity)
    return authority.begin("turn", page, {call.motor}, _turning(call.motor, call.velocity), "")


def _turning(motor: int, velocity: int) -> Steps[None]:
    """Turn a motor, and go on until the next command for it."""
    yield from motion.send(commands.rotate(motor, velocity))
    while True:
        yield Pause(PATIENCE_S)


async def _profile(authority: Authority, tell: Tell, page: Window, call: wire.Profile) -> int:
    _expect([call.motor], call.low, call.high)
    if not 0 <= call.low <= call.high or call.step < 1:
        raise wire.RefusalError("range", "A profile goes up, from the lower to the higher velocity.")

    def measured(load: LoadReading) -> None:
        tell(wire.ProfilePoint(call.motor, load.velocity, load.mean, load.deviation))

    steps = measure(call.motor, range(call.low, call.high + 1, call.step), measured)
    end = f"The load profile of motor {call.motor} is complete."
    return authority.begin("profile", page, {call.motor}, steps, end)


def _summary(items: Sequence[wire.Watched]) -> str:
    """What storing these brings about, for people."""
    names = [_name(item) for item in items[:_NAMED]]
    rest = f" and {len(items) - _NAMED} more" if len(items) > _NAMED else ""
    return f"{', '.join(names)}{rest}: what the EEPROM holds of these now is replaced by the present values."


def _name(item: wire.Watched) -> str:
    axis = item.bank == AXIS_BANK
    row = AXIS_BY_NUMBER.get(item.number) if axis else GLOBAL_BY_NUMBER.get((item.bank, item.number))
    name = row.name if row is not None else f"parameter {item.number}"
    return f"{name} of motor {item.motor}" if axis else name


def _kept(item: wire.Watched) -> bool:
    """Whether it is of a bank of parameters and its number fits in a telegram."""
    fits = 0 <= item.number <= 255 and AXIS_BANK <= item.bank <= 255
    return fits and (item.bank != AXIS_BANK or 0 <= item.motor < MOTORS)


async def _keep(authority: Authority, tell: Tell, page: Window, call: wire.Keep) -> int:
    if not all(map(_kept, call.items)):
        raise wire.RefusalError("range", f"Numbers and banks are 0..255, motors 0..{MOTORS - 1}.")
    if call.action == "store" and authority.real and not call.sure:
        raise wire.RefusalError("confirm", _summary(call.items))
    title = "Storing" if call.action == "store" else "Restoring"
    steps = keep(
        call.action,
        [(item.bank, item.number, item.motor) for item in call.items],
        lambda done, total: tell(wire.Progress(title, done, total)),
    )
    count = len(call.items)
    end = f"{count} value{'s are' if count != 1 else ' is'} {KEPT[call.action]}."
    return authority.begin(call.action, page, (), steps, end)


BEGIN: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.Jog: _jog, wire.Stride: _stride, wire.Zero: _zero, wire.Search: _search, wire.Go: _go, wire.Turn: _turn,
    wire.Profile: _profile, wire.Keep: _keep,
}  # fmt: skip
"""Each begins something that belongs to the window; refused during a download."""
