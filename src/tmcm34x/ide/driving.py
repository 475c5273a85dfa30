"""Operations of the host library on the IDE's module, wherever it is: each command is an exchange of the target."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING, Final, TypeVar

from tmcm34x import clock
from tmcm34x.host.answer import Answer, decode
from tmcm34x.host.exceptions import NoReplyError
from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.host.steps import NUMBERS, Clock, Pause, Step, Steps, Work
from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_reply
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target

T = TypeVar("T")
Exchanging = Callable[[Instruction], Awaitable[wire.Exchange]]
"""Sends a command and waits for its answer; status 0 is none in time."""
_GAP: Final = NUMBERS["GAP"]


async def run(exchange: Exchanging, steps: Steps[T]) -> T:
    """Drive an operation to its end.  Raises `HostError` and what `exchange` raises."""
    return await _drive(partial(_perform, exchange), steps)


async def attend(target: Target, steps: Steps[T]) -> T:
    """Drive an operation that waits for motors: its time is the module's, and what it only reads is not logged.

    A task that is cancelled sends nothing more than what the operation does at its end.  Raises `HostError`.
    """
    return await _drive(partial(_attend, target), steps)


async def _drive(perform: Callable[[Step], Awaitable[object]], steps: Steps[T]) -> T:
    work = Work(steps)
    while work.step is not None:
        try:
            answer = await perform(work.step)
        except BaseException as error:
            work.throw(error)
        else:
            work.send(answer)
    return work.result


async def _attend(target: Target, step: Step) -> object:
    match step:
        case Instruction(number, type_, motor) if number == _GAP:
            return await _look(target, step, wire.Watched(AXIS_BANK, type_, motor))
        case Clock():
            return target.now / clock.HZ
        case _:
            return await _perform(target.exchange, step)


async def _look(target: Target, instruction: Instruction, item: wire.Watched) -> Answer:
    (value,) = await target.read([item])
    if value is None:
        raise NoReplyError(instruction, "the value cannot be read")
    return Answer(Status.OK, value, pack_reply(Reply(0, 0, Status.OK, instruction.number, value)))


async def _perform(exchange: Exchanging, step: Step) -> Answer | float | None:
    match step:
        case Instruction():
            return await _ask(exchange, step)
        case Pause(seconds):
            await asyncio.sleep(seconds)
        case Clock():
            return asyncio.get_running_loop().time()
        case _:  # the target follows changes of its line by itself
            pass
    return None


async def _ask(exchange: Exchanging, instruction: Instruction) -> Answer:
    done = await exchange(instruction)
    if not done.received:
        raise NoReplyError(instruction, done.meaning)
    return decode(instruction, bytes.fromhex(done.received))
