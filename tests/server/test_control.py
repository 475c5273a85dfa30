"""The control socket's connections."""

import asyncio
import json
import socket

from far_ends import far_end
from tmcm34x.bench import simple_rig
from tmcm34x.bench.counters import Counters
from tmcm34x.server import Server
from tmcm34x.server.control import Control


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
