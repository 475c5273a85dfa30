"""Starts servers by forking and kills them, as its standard input says; for `test_store`."""

import asyncio
import os
import signal
import sys

from tmcm34x.bench import simple_rig
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.links.tcp import TcpLink
from tmcm34x.server import EepromFile, Server, Store


async def serve(path, address_to):
    """Serve a module with its memory at `path` for ever; write the address to a pipe."""
    file = EepromFile(path)
    data = file.load()
    rig = simple_rig(343, None if data is None else Eeprom.from_bytes(data))
    store = Store(rig.modules[0].eeprom, file, sys.stderr.write)
    store.begin()
    server = Server(rig, stores=[store])
    address = await server.open(TcpLink("127.0.0.1", 0))
    os.write(address_to, address.encode())
    os.close(address_to)
    await asyncio.Event().wait()


def start(path):
    """Process number and address of a new server."""
    reads, writes = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            os.close(0)
            os.close(1)
            os.close(reads)
            asyncio.run(serve(path, writes))
        finally:
            os._exit(1)
    os.close(writes)
    address = os.read(reads, 100).decode()
    os.close(reads)
    return pid, address


def kill(pid):
    """End a server as nothing else does."""
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def answer(text):
    """A line of standard output."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main():
    """Do what the lines say."""
    pid = 0
    try:
        for line in sys.stdin:
            word, _, path = line.strip().partition(" ")
            if word == "serve":
                pid, address = start(path)
                answer(address)
            else:
                kill(pid)
                pid = 0
                answer("killed")
    finally:
        if pid:
            kill(pid)


main()
