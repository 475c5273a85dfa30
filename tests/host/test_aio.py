"""The asyncio face: the same operations, awaited and cancelled."""

import asyncio

import pytest

from host_rigs import PROGRAM
from tmcm34x.host import AsyncConnection, NoReplyError, backup, program
from tmcm34x.host.steps import value
from tmcm34x.tmcl.datagram import Instruction


def test_operations_are_awaited_one_after_the_other():
    async def run():
        async with await AsyncConnection.open("virtual:343") as connection:
            await connection.run(program.download(PROGRAM))
            reads = [connection.run(value(Instruction(6, 4, motor))) for motor in range(3)]
            assert await asyncio.gather(*reads) == [1000, 1000, 1000]
            assert (await connection.ask(Instruction(6, 4))).value == 1000
            return await connection.run(backup.read())

    saved = asyncio.run(run())
    assert saved.complete
    assert saved.program == PROGRAM


def test_errors_arrive():
    async def run():
        async with await AsyncConnection.open("virtual:343?address=1&baud=19200&timeout=0.1") as connection:
            await connection.run(value(Instruction(6, 4)))

    with pytest.raises(NoReplyError):
        asyncio.run(run())


def test_a_task_that_is_cancelled_leaves_the_module_out_of_download_mode():
    async def run():
        async with await AsyncConnection.open("virtual:343") as connection:
            begun = asyncio.Event()
            loop = asyncio.get_running_loop()

            def progress(done, total):
                if done == 5:
                    loop.call_soon_threadsafe(begun.set)

            task = asyncio.create_task(connection.run(program.download(PROGRAM * 40, progress=progress)))
            await begun.wait()
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            assert await connection.run(value(Instruction(10, 129))) == 0
            return await connection.run(value(Instruction(6, 4)))

    assert asyncio.run(run()) == 1000
