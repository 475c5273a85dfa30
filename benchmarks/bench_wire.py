"""Telegrams on a line, against a bare echo on the same kind of link with the same client.

The client sends nine bytes and waits for nine.  The echo is the thinnest that asyncio allows: a reader
callback on the pseudo terminal, a `Protocol` on the socket.  Echo and module take turns, so that both see
the same machine; the ratio is that of the median round trips, in which other work on the machine counts least.

Must reach: 0.95 of the echo's round trips on the compiled core, 0.85 in Python; 99th percentile under 1 ms.  With a
memory file: 0.95 of the round trips without one for commands that store nothing, and 2,000 stores a second.
"""

import os
import select
import socket
import statistics
import subprocess
import sys
import tempfile
import time

from core import NAME, mark

from tmcm34x.tmcl.datagram import Instruction, pack_request

LEAST = mark(0.95, 0.85)
"""Of the echo's round trips."""
TURNS = 25
TURN_S = 0.12
SERVE = [sys.executable, "-m", "tmcm34x", "serve"]

ECHO = """
import asyncio, os, sys, tty
async def pty():
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    asyncio.get_running_loop().add_reader(master, lambda: os.write(master, os.read(master, 4096)))
    print("ready pty", os.ttyname(slave), flush=True)
    await asyncio.Event().wait()
class Echo(asyncio.Protocol):
    def connection_made(self, transport):
        self.data_received = transport.write
async def tcp():
    server = await asyncio.get_running_loop().create_server(Echo, "127.0.0.1", 0)
    print("ready tcp 127.0.0.1:%d" % server.sockets[0].getsockname()[1], flush=True)
    await asyncio.Event().wait()
asyncio.run({"pty": pty, "tcp": tcp}[sys.argv[1]]())
"""


class Peer:
    """A server process and a client connected to it."""

    def __init__(self, kind: str, command: list[str]) -> None:
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        address = self.process.stdout.readline().split()[2]
        if kind == "pty":
            self.fd = os.open(address, os.O_RDWR | os.O_NOCTTY)
        else:
            host, port = address.split(":")
            self.socket = socket.create_connection((host, int(port)))
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.fd = self.socket.fileno()

    def ask(self, telegram: bytes) -> bytes:
        """One round trip."""
        os.write(self.fd, telegram)
        reply = os.read(self.fd, 9)
        while len(reply) < 9:
            if not select.select([self.fd], [], [], 5)[0]:
                raise TimeoutError(f"only {len(reply)} bytes came back")
            reply += os.read(self.fd, 9 - len(reply))
        return reply

    def round_trips(self, telegram: bytes) -> list[float]:
        """The times of as many round trips as fit into a turn [s]."""
        times, now, end = [], time.perf_counter(), time.perf_counter() + TURN_S
        while now < end:
            self.ask(telegram)
            then, now = now, time.perf_counter()
            times.append(now - then)
        return times

    def stop(self) -> None:
        """End the process."""
        self.process.terminate()
        self.process.wait()


def measure(kind: str, echo: Peer, module: Peer, telegram: bytes, prepare: bytes = b"") -> bool:
    """Print one row; returns whether it reaches what it must."""
    all_echo_times, module_times = [], []
    for _ in range(TURNS):
        if prepare:
            for start in range(0, len(prepare), 9):
                module.ask(prepare[start : start + 9])
        echo_times, times = echo.round_trips(telegram), module.round_trips(telegram)
        all_echo_times += echo_times
        module_times += times
    module_times.sort()
    p50, p99 = (module_times[len(module_times) * n // 100] * 1e6 for n in (50, 99))
    echo_s, module_s = statistics.median(all_echo_times), statistics.median(module_times)
    ratio = echo_s / module_s
    state = "moving" if prepare else "at rest"
    print(f"{kind:4} {state:8} {1 / echo_s:9.0f} {1 / module_s:9.0f} {ratio:6.2f} {p50:8.0f} {p99:8.0f}")
    return ratio >= LEAST and p99 < 1000


def measure_memory() -> bool:
    """Print what a memory file costs; returns whether it reaches what it must."""
    gap, store = pack_request(1, Instruction(6, 1, 0)), pack_request(1, Instruction(9, 68, 0, 1))
    with tempfile.TemporaryDirectory() as folder:
        plain = Peer("tcp", [*SERVE, "--tcp", "0"])
        kept = Peer("tcp", [*SERVE, "--tcp", "0", "--eeprom", f"{folder}/memory"])
        try:
            turns = [
                [
                    len(peer.round_trips(telegram))
                    for peer, telegram in ((plain, gap), (kept, gap), (kept, store))
                ]
                for _ in range(TURNS)
            ]
        finally:
            plain.stop()
            kept.stop()
    ratio = statistics.median(with_file / without for without, with_file, _ in turns)
    rate = statistics.median(stores for _, _, stores in turns) / TURN_S
    print(f"tcp with a memory file: {ratio:.2f} of the round trips without one; {rate:.0f} stores/s")
    return ratio >= 0.95 and rate > 2000


def main() -> int:
    """Print the table; status 1 when a row misses its mark."""
    gap = pack_request(1, Instruction(6, 1, 0))
    moves = b"".join(
        pack_request(1, Instruction(number, 0, motor, value))
        for motor in range(3)
        for number, value in ((5, 0), (4, 1_000_000 * (motor + 1)))
    )
    print(f"round trips of nine bytes, core: {NAME}")
    print(f"{'link':4} {'axes':8} {'echo/s':>9} {'module/s':>9} {'ratio':>6} {'p50 us':>8} {'p99 us':>8}")
    reached = True
    for kind, option in (("pty", ["--pty"]), ("tcp", ["--tcp", "0"])):
        echo, module = Peer(kind, [sys.executable, "-c", ECHO, kind]), Peer(kind, [*SERVE, *option])
        try:
            reached &= measure(kind, echo, module, gap)
            reached &= measure(kind, echo, module, gap, moves)
        finally:
            echo.stop()
            module.stop()
    reached &= measure_memory()
    print(f"must: ratio at least {LEAST}, p99 under 1000 us:", "reached" if reached else "MISSED")
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
