"""Many live modules on one line: what a telegram to one of them costs, against the only module of a bench.

    python benchmarks/bench_many.py

Served as `tmcm34x serve --bench` serves them, without the operating system in between; the wall clock goes on by the
time that a telegram takes at 9,600 bits per second.  Processor time, the best of some turns.

Must: a telegram to one of 1,000 modules, of which three move, within 1.5 times that to a single module.
"""

from __future__ import annotations

import sys
from time import process_time

from tmcm34x.bench import build
from tmcm34x.bench.description import parse
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import Instruction, pack_request

COUNT = 1000
MOST = 1.5
TELEGRAMS = 2000
TURNS = 7
TELEGRAM_S = 0.01
ADDRESSES = 255
"""The modules share them: the line has more modules than there are addresses."""


class Bench:
    """A server of so many modules, and one client."""

    def __init__(self, count: int) -> None:
        addresses = [n % ADDRESSES + 1 if n < ADDRESSES else 0 for n in range(count)]
        rig = build(parse("".join(f"[[module]]\naddress = {address}\n" for address in addresses)))
        self.wall_s = 0.0
        self.server = Server(rig, monotonic=lambda: self.wall_s, lazy=count > 1)
        self.replies: list[bytes] = []
        self.peer = self.server.connect("client", self.replies.append)
        for address in range(1, min(count, 3) + 1):
            self.ask(address, Instruction(1, 0, 0, 300))

    def ask(self, address: int, instruction: Instruction) -> None:
        """A telegram, after the time that it takes."""
        self.wall_s += TELEGRAM_S
        self.peer.receive(pack_request(address, instruction))

    def turn(self, address: int) -> float:
        """Seconds of the processor for a telegram and its reply."""
        self.replies.clear()
        start = process_time()
        for _ in range(TELEGRAMS):
            self.ask(address, Instruction(6, 1))
        took = process_time() - start
        assert len(self.replies) == TELEGRAMS
        return took / TELEGRAMS


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    one, many = Bench(1), Bench(COUNT)
    turns = [(one.turn(1), many.turn(1), many.turn(200)) for _ in range(TURNS)]
    single, moving, resting = map(min, zip(*turns, strict=True))
    print(f"telegram to the only module                {single * 1e6:6.1f} us")
    print(f"to one of {COUNT:,} that moves               {moving * 1e6:6.1f} us, {moving / single:.2f} times")
    print(
        f"to one of {COUNT:,} at rest                  {resting * 1e6:6.1f} us, {resting / single:.2f} times"
    )
    reached = max(moving, resting) <= MOST * single
    print(f"must: at most {MOST} times:", "reached" if reached else "MISSED")
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
