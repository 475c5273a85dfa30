"""Hosts as they should not be: rubbish, torn and glued telegrams, floods, hosts that never read and that vanish.

A server must go on answering, with bounded memory and file descriptors, and say nothing about it.  `SOAK_ROUNDS` makes
it last longer (`make soak`).
"""

import contextlib
import os
import random
import socket
import struct
import subprocess
import sys
import tty
from pathlib import Path

import pytest

from tmcm34x.tmcl.datagram import SIZE, Instruction, pack_request, unpack_reply

ROUNDS = int(os.environ.get("SOAK_ROUNDS", "60"))
ASK = pack_request(1, Instruction(10, 66, 0))
MOST_MEMORY = 20e6
"""Bytes by which a server may grow [B]."""


class Target:
    """A served module with every kind of link."""

    def __init__(self, served, control):
        addresses = dict(served.links)
        self.pid = served.process.pid
        self.tcp, self.pty, self.slcan = addresses["tcp"], addresses["pty"], addresses["slcan"]
        self.control = control

    def connect(self):
        host, port = self.tcp.rsplit(":", 1)
        return socket.create_connection((host, int(port)), timeout=60)

    def terminal(self, path):
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(fd)
        return fd

    @property
    def memory(self):
        lines = Path(f"/proc/{self.pid}/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))

    @property
    def files(self):
        return len(list(Path(f"/proc/{self.pid}/fd").iterdir()))


def rubbish(target, draw):
    with target.connect() as client:
        client.sendall(draw.randbytes(draw.randrange(1, 4000)))


def torn(target, draw):
    cut = draw.randrange(1, SIZE)
    with target.connect() as client:
        client.sendall(ASK[:cut])


def glued(target, draw):
    count = draw.randrange(1, 200)
    with target.connect() as client:
        client.sendall(ASK * count)
        data = b""
        while len(data) < count * SIZE:
            data += client.recv(65536)
        assert len(data) == count * SIZE


def reset(target, draw):
    with target.connect() as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.sendall(ASK * draw.randrange(1, 3000))


def never_reads(target, draw):
    """A host that sends on and on and takes no reply."""
    with target.connect() as client:
        client.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            for _ in range(2000):
                client.send(ASK * 100)


def many(target, draw):
    clients = [target.connect() for _ in range(draw.randrange(1, 40))]
    for client in clients:
        client.close()


def terminal(path):
    def attack(target, draw):
        fd = target.terminal(getattr(target, path))
        with contextlib.suppress(BlockingIOError):
            for _ in range(draw.randrange(1, 20)):
                os.write(fd, draw.randbytes(draw.randrange(1, 500)) + b"\r")
        os.close(fd)

    return attack


def control(target, draw):
    client = socket.socket(socket.AF_UNIX)
    with client:
        client.connect(target.control)
        client.sendall(
            draw.choice([draw.randbytes(300) + b"\n", b'{"do":', b'{"do": "state"}\n' * 50, b"[" * 5000])
        )


ATTACKS = (rubbish, torn, glued, reset, never_reads, many, terminal("pty"), terminal("slcan"), control)


def test_a_server_survives_hosts_as_they_should_not_be(serve, tmp_path, wait_for):
    path = tmp_path / "control"
    served = serve("--tcp", 0, "--pty", "--slcan", "--control", path, "--eeprom", tmp_path / "memory")
    target, draw = Target(served, str(path)), random.Random(34)
    with target.connect() as host:

        def answers():
            host.sendall(ASK)
            data = b""
            while len(data) < SIZE and (chunk := host.recv(SIZE - len(data))):
                data += chunk
            return unpack_reply(data).status in {100, 5, 6, 101}

        for attack in ATTACKS:
            attack(target, draw)
        assert answers()
        memory, files = target.memory, target.files
        for number in range(ROUNDS):
            draw.choice(ATTACKS)(target, draw)
            if number % 10 == 0:
                assert answers()
        assert answers()
        assert target.memory - memory < MOST_MEMORY
        assert wait_for(lambda: target.files <= files + 2)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_same_seed_gives_the_same_run_with_any_hash_seed(seed):
    script = (
        "from tmcm34x.bench import simple_rig; from tmcm34x import clock\n"
        "from tmcm34x.links.faulty import Faults; from tmcm34x.links.memory import MemoryClient\n"
        "from tmcm34x.links.timing import VirtualTiming; from tmcm34x.server import Server\n"
        "from tmcm34x.tmcl.datagram import Instruction, pack_request\n"
        f"t = VirtualTiming(); f = Faults(t, {seed}); r = simple_rig(seed={seed})\n"
        "s = Server(r, monotonic=t.time); c = MemoryClient(f.wrap(s.connect))\n"
        "[f.add(x) for x in ('garble,probability=0.2', 'split,probability=0.2', 'silent,probability=0.1')]\n"
        "h = b''\n"
        "for n in range(200):\n"
        "    c.write(pack_request(1, Instruction(10, 133, 0) if n % 3 else Instruction(1, n % 3, 0, n)))\n"
        "    clock.run_until(t, t.now + 16000 * n); s.catch_up(); h += c.read()\n"
        "print(h.hex(), r.digest())\n"
    )
    runs = {
        subprocess.run(
            [sys.executable, "-c", script],
            capture_output=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": str(n)},
        ).stdout
        for n in (0, 1, 2)
    }
    assert len(runs) == 1
