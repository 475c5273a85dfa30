"""Clients over TCP."""

import asyncio
import contextlib
import resource
import socket
import struct

import pytest

from conftest import PATIENCE_S
from tmcm34x.links import LinkOpenError, tcp
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
    return await asyncio.wait_for(reader.readexactly(len(data)), PATIENCE_S)


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
            assert await asyncio.wait_for(reader.readexactly(len(sent)), PATIENCE_S) == sent
            await hang_up(writer)

    asyncio.run(scenario())


def test_closing_hangs_up_on_all_clients():
    async def scenario():
        async with served(Echo()) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            assert await talk(reader, writer, b"there") == b"there"
        with contextlib.suppress(ConnectionError):
            assert await asyncio.wait_for(reader.read(), PATIENCE_S) == b""
        with contextlib.suppress(ConnectionError):
            await hang_up(writer)

    asyncio.run(scenario())


def test_a_port_in_use_is_refused_in_one_line():
    async def scenario():
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            with pytest.raises(LinkOpenError) as caught:
                await TcpLink("127.0.0.1", port).open(Echo().connect)
            assert str(caught.value) == f"cannot listen on 127.0.0.1:{port}: Address already in use"

    asyncio.run(scenario())


def test_an_unknown_host_is_refused():
    async def scenario():
        with pytest.raises(LinkOpenError, match=r"cannot listen on no-such-host\.invalid:0"):
            await TcpLink("no-such-host.invalid", 0).open(Echo().connect)

    asyncio.run(scenario())


def test_more_connections_than_there_is_room_for_are_reset_and_the_others_stay(monkeypatch):
    monkeypatch.setattr(tcp, "most_clients", lambda: 3)

    async def scenario():
        echo = Echo()
        async with served(echo) as port:
            inside = [await asyncio.open_connection("127.0.0.1", port) for _ in range(3)]
            for reader, writer in inside:
                assert await talk(reader, writer, b"here") == b"here"
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            with contextlib.suppress(ConnectionError):
                assert await reader.read() == b""
            writer.close()
            for reader, writer in inside:
                assert await talk(reader, writer, b"still") == b"still"
            await hang_up(inside.pop()[1])
            while len(echo.gone) < 1:
                await asyncio.sleep(0.001)
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            assert await talk(reader, writer, b"next") == b"next"
            for _, each in (*inside, (reader, writer)):
                await hang_up(each)

    asyncio.run(scenario())


def test_the_most_connections_leave_files_for_others():
    assert 0 < tcp.most_clients() <= resource.getrlimit(resource.RLIMIT_NOFILE)[0] // 2


def test_a_host_that_vanishes_without_a_word_is_noticed():
    async def scenario():
        echo = Echo()
        async with served(echo) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            assert await talk(reader, writer, b"here") == b"here"
            (client,) = tcp._CLIENTS
            connection = client._transport.get_extra_info("socket")
            assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE) == 60
            await hang_up(writer)

    asyncio.run(scenario())


def test_replies_to_a_reset_connection_are_lost_without_a_word(caplog):
    """asyncio would complain of each but the first five, on the user's terminal."""

    class Talker:
        def connect(self, name, send):
            self.send = send
            return self

        def receive(self, data):
            for _ in range(1000):
                self.send(bytes(9000))

        def disconnect(self):
            pass

    async def scenario():
        link = TcpLink("127.0.0.1", 0)
        port = int((await link.open(Talker().connect)).rpartition(":")[2])
        for _ in range(5):
            client = socket.create_connection(("127.0.0.1", port))
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.sendall(b"go")
            client.close()
            await asyncio.sleep(0.01)
        link.close()

    asyncio.run(scenario())
    assert not caplog.records
