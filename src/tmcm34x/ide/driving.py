"""Operations of the host library on the IDE's module, wherever it is: each command is an exchange of the target."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TypeVar

from tmcm34x.host.answer import Answer, decode
from tmcm34x.host.exceptions import NoReplyError
from tmcm34x.host.steps import Clock, Pause, Step, Steps, Work
from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction

T = TypeVar("T")
Exchanging = Callable[[Instruction], Awaitable[wire.Exchange]]
"""Sends a command and waits for its answer; status 0 is none in time."""


async def run(exchange: Exchanging, steps: Steps[T]) -> T:
    """Drive an operation to its end.  Raises `HostError` and what `exchange` raises."""
    work = Work(steps)
    while work.step is not None:
        try:
            answer = await _perform(exchange, work.step)
        except BaseException as error:
            work.throw(error)
        else:
            work.send(answer)
    return work.result


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
