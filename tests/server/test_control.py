"""The control socket's connections."""

import asyncio
import contextlib
import gc
import json
import socket

from tmcm34x.bench import simple_rig
from tmcm34x.bench.counters import Counters
from tmcm34x.server import Server
from tmcm34x.server.control import Control


def far_end(address):
    """The server's end of a connection."""
    for sock in gc.get_objects():
        if isinstance(sock, socket.socket) and sock.fileno() >= 0:
            with contextlib.suppress(OSError):
                if sock.getpeername() == address:
                    return sock
    raise AssertionError


def test_a_client_whose_computer_is_gone_is_found_out():
    async def scenario():
        rig = simple_rig(343)
        control = Control(Server(rig), "127.0.0.1:0", Counters(rig))
        host, port = (await control.open()).split(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        writer.write(b"{}\n")
        assert "error" in json.loads(await reader.readline())
        end = far_end(writer.get_extra_info("sockname"))
        assert end.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        writer.close()
        await writer.wait_closed()
        await control.close()

    asyncio.run(scenario())
