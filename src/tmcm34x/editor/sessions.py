"""Sessions of the language server: over any connection of messages, over standard input and output, over TCP.

Source: Language Server Protocol 3.17, base protocol.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from typing import Final

from lsprotocol import types
from pygls.exceptions import JsonRpcException

from tmcm34x.editor.language_server import TmclServer
from tmcm34x.editor.workspace import Files
from tmcm34x.links.tcp import MOST_EDITORS, STALL_S, keep_alive, most_clients

_LARGEST_MESSAGE: Final = 64 * 1024 * 1024
"""Bytes."""
_MOST_WAITING: Final = 16
"""Messages that wait for the client before the next one of its own is read."""


class _Writer:
    """What pygls writes to: whole messages without a header, in order."""

    def __init__(self) -> None:
        self._messages: asyncio.Queue[str | None] = asyncio.Queue()
        self._sent = asyncio.Event()
        self._over = False

    def write(self, data: bytes) -> None:
        self._messages.put_nowait(data.decode())

    def close(self) -> None:
        self._messages.put_nowait(None)

    async def pump(self, send: Callable[[str], Awaitable[object]]) -> None:
        """Send what is written, until it is closed."""
        try:
            while (message := await self._messages.get()) is not None:
                await send(message)
                self._sent.set()
        finally:
            self._over = True
            self._sent.set()

    async def drain(self) -> None:
        """Wait until little is left to be sent."""
        while self._messages.qsize() > _MOST_WAITING and not self._over:
            self._sent.clear()
            await self._sent.wait()


async def serve_messages(
    received: AsyncIterator[str | bytes],
    send: Callable[[str], Awaitable[object]],
    files: Files,
    include_path: Sequence[str] = (),
    model: int = 343,
) -> None:
    """One session over any connection that carries JSON-RPC texts; ends with `received` or at `exit`.

    received: the client's messages, one text each
    send: sends one message to the client
    """
    server = TmclServer(files, include_path, model)
    writer = _Writer()
    server.protocol.set_writer(writer, include_headers=False)

    pumping = asyncio.create_task(writer.pump(send))
    try:
        async for text in received:
            if not _handle(server, writer, text):
                break
            await writer.drain()
    except asyncio.CancelledError:
        pumping.cancel()
        raise
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError, asyncio.CancelledError):
            await pumping
        server.shutdown()
        _forget(server)


def _forget(server: TmclServer) -> None:
    """Let a session go: caches of pygls that all sessions share hold their keys' sessions."""
    protocol = type(server.protocol)
    protocol.get_message_type.cache_clear()
    protocol.get_result_type.cache_clear()


def _handle(server: TmclServer, writer: _Writer, text: str | bytes) -> bool:
    """Passes one message to the server; returns whether the session goes on."""
    protocol = server.protocol
    try:
        message = json.loads(text, object_hook=protocol.structure_message)
    except (ValueError, RecursionError, JsonRpcException):
        error = {"code": types.ErrorCodes.ParseError.value, "message": "not a message of the protocol"}
        writer.write(json.dumps({"jsonrpc": "2.0", "id": None, "error": error}).encode())
        return True
    if getattr(message, "method", "") == types.EXIT:
        return False
    if hasattr(message, "jsonrpc"):
        protocol.handle_message(message)
    return True


def serve_stdio(files: Files, include_path: Sequence[str] = (), model: int = 343) -> None:
    """One session over standard input and output; returns when it is over."""
    TmclServer(files, include_path, model).start_io()


async def serve_tcp(
    host: str,
    port: int,
    files: Files,
    include_path: Sequence[str] = (),
    model: int = 343,
    *,
    ready: Callable[[str, int], object] = lambda _host, _port: None,
    stall_s: float = STALL_S,
    first_s: float = STALL_S,
) -> None:
    """Sessions with all editors that connect, `MOST_EDITORS` at a time; more are reset at once.

    ready: gets the address, which port 0 leaves to the system
    stall_s: how long an editor may take nothing of what is sent to it [s]
    first_s: how long it has for its first line [s]
    """
    places = asyncio.Semaphore(min(MOST_EDITORS, most_clients()))

    async def session(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def send(text: str) -> None:
            body = text.encode()
            writer.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
            await _taken(writer, stall_s)

        try:
            async with places:
                await serve_messages(_framed(reader, first_s), send, files, include_path, model)
        except asyncio.CancelledError:
            pass  # The server ends; asyncio would print a session that is cancelled.
        finally:
            writer.close()

    async def greet(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if places.locked():
            writer.transport.abort()
            return
        keep_alive(writer.get_extra_info("socket"))
        await session(reader, writer)

    server = await asyncio.start_server(greet, host, port)
    ready(*server.sockets[0].getsockname()[:2])
    async with server:
        await server.serve_forever()


async def _taken(writer: asyncio.StreamWriter, stall_s: float) -> None:
    """Wait until little is left to be sent.  Resets the connection when nothing is taken for too long."""
    transport = writer.transport
    while True:
        left = transport.get_write_buffer_size()
        try:
            async with asyncio.timeout(stall_s):
                await writer.drain()
        except TimeoutError:
            if transport.get_write_buffer_size() < left:
                continue
            transport.abort()
            raise ConnectionAbortedError from None
        return


async def _framed(reader: asyncio.StreamReader, first_s: float) -> AsyncIterator[bytes]:
    """The messages of a stream with headers; ends with the stream, and where it is none of ours.

    first_s: how long the first line may take [s]
    """
    length = 0
    with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError, TimeoutError, ValueError):
        async with asyncio.timeout(first_s):
            line = await reader.readline()
        while line:
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
            elif not line.strip():
                if not 0 < length <= _LARGEST_MESSAGE:
                    return
                yield await reader.readexactly(length)
                length = 0
            line = await reader.readline()
