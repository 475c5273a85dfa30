"""The language server: from a keystroke to its diagnostics, in programs of 2,048 and of 10,000 lines.

A real server process on pipes.  Each turn changes one line, so that the findings change too, sends the change, and
waits for the message with the findings.  What counts is the server's processor time and the pause in which it waits for
further changes, so that other work on the computer does not; on systems where the processor time of another process
cannot be read, the wall clock counts.

Must reach: 60 ms from the change to the diagnostics, after each of the keystrokes.
"""

import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

from bench_toolchain import program

from tmcm34x.editor.language_server import PAUSE_S

TURNS = 40
WARM_UP = 5
LIMIT_MS = 60


class Server:
    """A language server on the other end of two pipes."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "tmcm34x", "lsp", "--stdio"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def send(self, **message: object) -> None:
        """Write one message."""
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.process.stdin.flush()

    def receive(self) -> dict:
        """Read one message."""
        length = int(self.process.stdout.readline().partition(b":")[2])
        while self.process.stdout.readline().strip():
            pass
        return json.loads(self.process.stdout.read(length))

    def seconds(self) -> float:
        """Its processor time so far; the wall clock where that cannot be read."""
        try:
            return float(Path(f"/proc/{self.process.pid}/schedstat").read_text().split()[0]) / 1e9
        except OSError:
            return time.perf_counter()

    def diagnostics(self) -> list:
        """The next ones."""
        while (message := self.receive()).get("method") != "textDocument/publishDiagnostics":
            pass
        return message["params"]["diagnostics"]


def long_program() -> list[str]:
    """10,000 lines, most of them comments and constants, with names from an include file."""
    lines = ["#include TMCLParam.tmc", *(f"Unused{n} = {n}" for n in range(300)), *program().split("\n")]
    remarks = ("        // a remark on {}", "", "// what comes after {}")
    spread = [text.format(n) for n, line in enumerate(lines) for text in (line, *remarks)]
    return [*spread, *(f"// the end, {n}" for n in range(10_000 - len(spread)))]


def measure(server: Server, uri: str, lines: list[str]) -> bool:
    """Prints the times of some keystrokes; returns whether they are short enough."""
    document = {"uri": uri, "languageId": "tmcl", "version": 1, "text": "\n".join(lines)}
    server.send(method="textDocument/didOpen", params={"textDocument": document})
    server.diagnostics()
    place = next(n for n, line in enumerate(lines) if n > len(lines) // 2 and "WAIT POS" in line)
    times, walls = [], []
    for turn in range(WARM_UP + TURNS):
        text = f"        MVP   ABS, 0, {turn} + oops" if turn % 2 else f"        MVP   ABS, 9, {turn}"
        where = {
            "start": {"line": place, "character": 0},
            "end": {"line": place, "character": len(lines[place])},
        }
        lines[place] = text
        change = {
            "textDocument": {"uri": uri, "version": turn + 2},
            "contentChanges": [{"range": where, "text": text}],
        }
        start, wall = server.seconds(), time.perf_counter()
        server.send(method="textDocument/didChange", params=change)
        found = server.diagnostics()
        times.append((server.seconds() - start + PAUSE_S) * 1e3)
        walls.append((time.perf_counter() - wall) * 1e3)
        assert found
    server.send(method="textDocument/didClose", params={"textDocument": {"uri": uri}})
    server.diagnostics()
    middle, worst = statistics.median(times[WARM_UP:]), max(times[WARM_UP:])
    ok = worst <= LIMIT_MS
    print(f"{len(lines):>6} lines: diagnostics {middle:.1f} ms after a keystroke, at worst {worst:.1f} ms; must be at "
          f"most {LIMIT_MS} ms  {'ok' if ok else 'MISSED'} (wall clock {statistics.median(walls):.1f} ms)")  # fmt: skip
    return ok


def main() -> int:
    """Print the figures; status 1 when the mark is missed."""
    server = Server()
    server.send(id=1, method="initialize", params={"processId": None, "rootUri": None, "capabilities": {}})
    server.receive()
    short = measure(server, "file:///nowhere/bench.tmc", program().split("\n"))
    long = measure(server, "file:///nowhere/long.tmc", long_program())
    server.process.kill()
    return 0 if short and long else 1


if __name__ == "__main__":
    sys.exit(main())
