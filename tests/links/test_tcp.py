"""Clients over TCP."""

import asyncio
import contextlib
import socket

import pytest

from tmcm34x.links import LinkError
from tmcm34x.links.tcp import TcpLink


class Echo:
    """Answers each client with what it sends, and remembers who came and went."""

    def __init__(self):
        self.names = []
        self.gone = []

    def connect(self, name, send):
        self.names.append(name)
        return EchoPeer(self, name, send)


class EchoPeer:
    def __init__(self, echo, name, send):
        self.echo, self.name, self.receive = echo, name, send

    def disconnect(self):
        self.echo.gone.append(self.name)


@contextlib.asynccontextmanager
async def served(echo, host="127.0.0.1"):
    link = TcpLink(host, 0)
    address = await link.open(echo.connect)
    try:
        yield int(address.rpartition(":")[2])
    finally:
        link.close()


async def talk(reader, writer, data):
    writer.write(data)
    return await asyncio.wait_for(reader.readexactly(len(data)), 2)


async def hang_up(writer):
    writer.close()
    await writer.wait_closed()


def test_clients_are_served_at_once_and_one_after_the_other():
    async def scenario():
        echo = Echo()
        async with served(echo) as port:
            first = await asyncio.open_connection("127.0.0.1", port)
            second = await asyncio.open_connection("127.0.0.1", port)
            assert await talk(*first, b"first") == b"first"
            assert await talk(*second, b"second") == b"second"
            assert await talk(*first, b"again") == b"again"
            await hang_up(first[1])
            third = await asyncio.open_connection("127.0.0.1", port)
            assert await talk(*third, b"third") == b"third"
            assert len(set(echo.names)) == 3
            assert echo.gone == echo.names[:1]
            await hang_up(second[1])
            await hang_up(third[1])

    asyncio.run(scenario())


def test_a_client_that_reads_late_loses_nothing():
    sent = bytes(range(256)) * 40_000

    async def scenario():
        echo = Echo()
        async with served(echo) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(sent)
            assert await asyncio.wait_for(reader.readexactly(len(sent)), 10) == sent
            await hang_up(writer)

    asyncio.run(scenario())


def test_closing_hangs_up_on_all_clients():
    async def scenario():
        async with served(Echo()) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            assert await talk(reader, writer, b"there") == b"there"
        with contextlib.suppress(ConnectionError):
            assert await asyncio.wait_for(reader.read(), 2) == b""
        with contextlib.suppress(ConnectionError):
            await hang_up(writer)

    asyncio.run(scenario())


def test_a_port_in_use_is_refused_in_one_line():
    async def scenario():
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            with pytest.raises(LinkError) as caught:
                await TcpLink("127.0.0.1", port).open(Echo().connect)
            assert str(caught.value) == f"cannot listen on 127.0.0.1:{port}: Address already in use"

    asyncio.run(scenario())


def test_an_unknown_host_is_refused():
    async def scenario():
        with pytest.raises(LinkError, match=r"cannot listen on no-such-host\.invalid:0"):
            await TcpLink("no-such-host.invalid", 0).open(Echo().connect)

    asyncio.run(scenario())
