"""The asyncio face: the same logic as `connection`, awaited.

    async with AsyncConnection.open("tcp:192.168.1.7:17000") as connection:
        await connection.run(program.download(instructions))
        position = await connection.run(steps.value(Instruction(GAP, 1, 0)))

Whatever the library does is an operation of steps (`motion`, `program`, `backup`, ...); this drives them.  A line
blocks; each of its calls runs in a thread of its own, one at a time.  A task that is cancelled leaves the module
safe, as an interrupt does: what an operation does at its end is still sent.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Self, TypeVar

from tmcm34x.host.answer import Answer
from tmcm34x.host.connection import Connection
from tmcm34x.host.line import open_line
from tmcm34x.host.steps import Pause, Step, Steps, Work
from tmcm34x.host.url import parse_url
from tmcm34x.tmcl.datagram import Instruction

T = TypeVar("T")


class AsyncConnection:
    """A `Connection` for asyncio."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self._thread = ThreadPoolExecutor(1, "tmcm34x line")
        self._turn = asyncio.Lock()

    @classmethod
    async def open(cls, url: str) -> Self:
        """A connection to `url`.  Raises `LinkError`."""
        name = parse_url(url)
        line = await asyncio.to_thread(open_line, name)
        return cls(Connection(line, address=name.address, timeout_s=name.timeout_s, retries=name.retries))

    async def close(self) -> None:
        """Hang up."""
        await self._in_thread(self.connection.close)
        self._thread.shutdown(wait=False)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def ask(self, instruction: Instruction) -> Answer:
        """Whatever the module answers, refusals included."""
        async with self._turn:
            return await self._in_thread(self.connection.ask, instruction)

    async def run(self, steps: Steps[T]) -> T:
        """Drive an operation to its end; other tasks wait for theirs."""
        async with self._turn:
            work = Work(steps)
            while work.step is not None:
                try:
                    answer = await self._perform(work.step)
                except BaseException as error:
                    work.throw(error)
                else:
                    work.send(answer)
            return work.result

    async def _perform(self, step: Step) -> Any:
        if isinstance(step, Pause) and self.connection.line.real:
            await asyncio.sleep(step.seconds)
            return None
        return await self._in_thread(self.connection.perform, step)

    async def _in_thread(self, work: Callable[..., T], *arguments: Any) -> T:
        """What is under way on the line is finished also when the task is cancelled, so that no reply is lost."""
        future = asyncio.get_running_loop().run_in_executor(self._thread, work, *arguments)
        try:
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            await asyncio.wait([future])
            raise
