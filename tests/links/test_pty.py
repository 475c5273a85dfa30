"""Pseudo terminals: what clients do to them."""

import asyncio
import contextlib
import os
import termios
import tty

import pytest

from links.descriptors import reads
from tmcm34x.links import LinkOpenError
from tmcm34x.links.posix.pty import PtyLink


class Echo:
    """A peer that answers with what it gets, and counts hang-ups."""

    def __init__(self):
        self.received = bytearray()
        self.clients = 0
        self.hang_ups = 0

    def connect(self, name, send):
        self.clients += 1
        self.send = send
        return self

    def receive(self, data):
        self.received += data
        self.send(data)

    def disconnect(self):
        self.hang_ups += 1


@contextlib.asynccontextmanager
async def served(link, peer):
    address = await link.open(peer.connect)
    try:
        yield address
    finally:
        link.close()


async def happens(condition, milliseconds=60_000):
    """Wait until `condition()` holds, a minute at most."""
    for _ in range(milliseconds):
        if condition():
            return True
        await asyncio.sleep(0.001)
    return False


def open_client(path):
    return os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)


def test_bytes_go_both_ways_unchanged():
    every_byte = bytes(range(256))

    async def scenario():
        async with served(PtyLink(), Echo()) as path:
            client = open_client(path)
            os.write(client, every_byte)
            assert await reads(client, 256) == every_byte
            os.close(client)

    asyncio.run(scenario())


def test_a_client_may_close_and_another_open():
    async def scenario():
        echo = Echo()
        async with served(PtyLink(), echo) as path:
            for count in range(1, 4):
                client = open_client(path)
                os.write(client, b"hello")
                assert await reads(client, 5) == b"hello"
                os.close(client)
                assert await happens(lambda: echo.hang_ups == count), count  # noqa: B023
            assert echo.clients == 3

    asyncio.run(scenario())


def test_replies_that_nobody_fetched_do_not_reach_the_next_client():
    async def scenario():
        echo = Echo()
        async with served(PtyLink(), echo) as path:
            first = open_client(path)
            os.write(first, b"stale")
            assert await happens(lambda: echo.received == b"stale")
            os.close(first)
            assert await happens(lambda: echo.hang_ups)
            second = open_client(path)
            os.write(second, b"fresh")
            assert await reads(second, 5) == b"fresh"
            os.close(second)

    asyncio.run(scenario())


def test_a_client_that_changed_the_terminal_mode_leaves_it_raw_for_the_next():
    async def scenario():
        echo = Echo()
        async with served(PtyLink(), echo) as path:
            first = open_client(path)
            mode = termios.tcgetattr(first)
            mode[tty.OFLAG] |= termios.OPOST | termios.ONLCR
            termios.tcsetattr(first, termios.TCSANOW, mode)
            os.write(first, b"x")
            assert await happens(lambda: echo.received)
            os.close(first)
            assert await happens(lambda: echo.hang_ups)
            second = open_client(path)
            os.write(second, b"\n\r")
            assert await reads(second, 2) == b"\n\r"
            os.close(second)

    asyncio.run(scenario())


def test_a_client_that_reads_late_loses_nothing():
    sent = bytes(range(256)) * 400

    async def scenario():
        async with served(PtyLink(), Echo()) as path:
            client = open_client(path)
            written = 0

            def full():
                nonlocal written
                with contextlib.suppress(BlockingIOError):
                    while written < len(sent):
                        written += os.write(client, sent[written:])
                return False

            await happens(full, 50)
            assert written < len(sent)  # neither side has room left
            received = b""
            while len(received) < len(sent):
                full()
                received += await reads(client, 1)
                with contextlib.suppress(BlockingIOError):
                    received += os.read(client, 65536)
            assert received == sent
            os.close(client)

    asyncio.run(scenario())


def test_the_bit_rate_that_the_client_sets_is_known():
    async def scenario():
        link = PtyLink()
        async with served(link, Echo()) as path:
            client = open_client(path)
            mode = termios.tcgetattr(client)
            mode[4] = mode[5] = termios.B115200
            termios.tcsetattr(client, termios.TCSANOW, mode)
            assert link.baud_rate() == 115200
            os.close(client)

    asyncio.run(scenario())


def test_the_symbolic_link_is_removed_at_the_end(tmp_path):
    link = tmp_path / "module"

    async def scenario():
        async with served(PtyLink(str(link)), Echo()) as path:
            assert path == str(link)
            assert link.is_char_device()

    asyncio.run(scenario())
    assert not link.is_symlink()


def test_a_link_that_somebody_else_has_put_there_meanwhile_stays(tmp_path):
    link = tmp_path / "module"

    async def scenario():
        async with served(PtyLink(str(link)), Echo()):
            link.unlink()
            link.symlink_to("/dev/null")

    asyncio.run(scenario())
    assert link.is_symlink()


def test_a_dangling_link_is_replaced(tmp_path):
    link = tmp_path / "module"
    link.symlink_to("/dev/pts/gone")

    async def scenario():
        async with served(PtyLink(str(link)), Echo()):
            assert link.is_char_device()

    asyncio.run(scenario())


@pytest.mark.parametrize("content", ["file", "link"])
def test_a_link_path_that_is_taken_is_refused_and_left_alone(tmp_path, content):
    link = tmp_path / "module"
    if content == "file":
        link.write_text("mine")
    else:
        link.symlink_to("/dev/null")

    async def scenario():
        with pytest.raises(LinkOpenError, match="already there"):
            await PtyLink(str(link)).open(Echo().connect)

    asyncio.run(scenario())
    assert link.exists()


def test_a_link_in_a_missing_folder_is_refused(tmp_path):
    async def scenario():
        with pytest.raises(LinkOpenError, match="No such file"):
            await PtyLink(str(tmp_path / "none" / "module")).open(Echo().connect)

    asyncio.run(scenario())
