"""What pages ask of the module and of the one authority over motion: single commands, stopping, what a page watches."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import MnemonicError, parse_instruction

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window

MAX_WATCHES: Final = 8
MAX_RATE_HZ: Final = 60


async def _execute(hub: Hub, page: Window, call: wire.Execute) -> wire.Exchange:
    fields = (call.number, call.type, call.motor)
    if any(not 0 <= field <= 255 for field in fields) or not -(2**31) <= call.value < 2**32:
        raise wire.RefusalError("range", "Command, type and motor are 0..255, the value has 32 bits.")
    value = call.value - 2**32 if call.value >= 2**31 else call.value
    return await _exchange(hub, Instruction(*fields, value), sure=call.sure)


async def _execute_text(hub: Hub, page: Window, call: wire.ExecuteText) -> wire.Exchange:
    try:
        instruction = parse_instruction(call.line)
    except MnemonicError as error:
        raise wire.RefusalError("text", f"{error}.") from error
    return await _exchange(hub, instruction, sure=call.sure)


async def _exchange(hub: Hub, instruction: Instruction, *, sure: bool) -> wire.Exchange:
    hub.expect_idle()
    hub.authority.permit(instruction, sure=sure)
    return await hub.target.exchange(instruction)


async def _send_ascii(hub: Hub, page: Window, call: wire.SendAscii) -> str:
    hub.authority.permit_line(call.line)
    return await hub.target.send_ascii(call.line)


async def _read_many(hub: Hub, page: Window, call: wire.ReadMany) -> list[int | None]:
    if not hub.target.ability.peek:
        hub.expect_idle()
    return await hub.target.read(call.items)


async def _stop_all(hub: Hub, page: Window, call: wire.StopAll) -> None:
    hub.loading.abort()
    hub.authority.stop_all(downloading=hub.loading.busy)


async def _release(hub: Hub, page: Window, call: wire.Release) -> None:
    hub.authority.release()


async def _arm(hub: Hub, page: Window, call: wire.Arm) -> None:
    hub.authority.arm(call.on)


async def _dismiss(hub: Hub, page: Window, call: wire.Dismiss) -> None:
    hub.authority.dismiss()


async def _abort(hub: Hub, page: Window, call: wire.Abort) -> None:
    hub.authority.abort(call.number)


async def _watch(hub: Hub, page: Window, call: wire.Watch) -> None:
    page.watches = call.items[:MAX_WATCHES]
    hub.watches_changed()


async def _set_rate(hub: Hub, page: Window, call: wire.SetRate) -> None:
    page.rate_hz = max(0, min(MAX_RATE_HZ, call.hz))


async def _follow_log(hub: Hub, page: Window, call: wire.FollowLog) -> None:
    page.follow_log(call)
    hub.telegrams.polls_wanted = any(other.wants_polls for other in hub.pages)


async def _ping(hub: Hub, page: Window, call: wire.Ping) -> None:
    return None


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.Execute: _execute,
    wire.ExecuteText: _execute_text,
    wire.SendAscii: _send_ascii,
    wire.ReadMany: _read_many,
    wire.StopAll: _stop_all,
    wire.Release: _release,
    wire.Arm: _arm,
    wire.Dismiss: _dismiss,
    wire.Abort: _abort,
    wire.Watch: _watch,
    wire.SetRate: _set_rate,
    wire.FollowLog: _follow_log,
    wire.Ping: _ping,
}
