"""Assembler and linter on 2,048 lines, against Python's own `tokenize` on a text of the same size.

The program is what people write: labels, words, expressions, comments, some constants.  The Python text is the
tool chain's own source, cut to the same number of characters.  Both take turns; each figure is a median of
processor time, each ratio a median of those of one turn.

Must reach: parse, check and assemble in 1.5 times the time of `tokenize`; the linter, assembling included, in 3 times.
"""

import io
import statistics
import sys
import time
import tokenize
from collections.abc import Callable
from pathlib import Path

from tmcm34x import toolchain
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import lint

LINES = 2048
TURNS = 25
BLOCK = (
    "Task{n}:  MVP ABS, {motor}, Distance{c} * 2 + {n}   // go there",
    "        WAIT POS, {motor}, 500",
    "        JC ETO, Failed",
    "        SAP 4, {motor}, SIN(RAD(30)) * Speed",
    "        GAP 1, {motor}",
    "        COMP {n}",
    "        JC GE, Task{n}          // not yet",
    "        SIO {motor}, 2, 1",
)


def program() -> str:
    """2,048 lines of TMCL."""
    lines = ["Speed = 500", *(f"Distance{n} = {n}00 // microsteps" for n in range(60))]
    count = 0
    while len(lines) < LINES - 3:
        block = (line.format(n=count, motor=count % 3, c=count % 60) for line in BLOCK)
        lines.extend(block)
        count += 1
    lines = [*lines[: LINES - 3], "        STOP", "Failed: CLE ETO", "        STOP"]
    return "\n".join(lines)


def python_text(size: int) -> str:
    """As many characters of Python; whatever `tokenize` needs at the end is there."""
    source = "".join(path.read_text() for path in sorted(Path(toolchain.__file__).parent.glob("*.py")))
    source = source * (size // len(source) + 1)
    end = source.index("\n\n\n", size)
    return source[:end]


def milliseconds(action: Callable[[], object]) -> float:
    """The processor time of one call."""
    start = time.process_time()
    action()
    return (time.process_time() - start) * 1e3


def main() -> int:
    """Print the table; status 1 when a row misses its mark."""
    text = program()
    assembly = assemble(text)
    assert assembly.ok, assembly.diagnostics[:3]
    python = python_text(len(text))
    actions: dict[str, Callable[[], object]] = {
        "tokenize": lambda: sum(1 for _ in tokenize.generate_tokens(io.StringIO(python).readline)),
        "assemble": lambda: assemble(text),
        "lint": lambda: lint(assemble(text)),
        "format": lambda: format_source(text),
    }
    times: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(TURNS):
        for name, action in actions.items():
            times[name].append(milliseconds(action))
    middle = {name: statistics.median(values) for name, values in times.items()}
    missed = 0
    print(f"{len(text.splitlines())} lines, {len(text)} characters, {len(assembly.code)} instructions")
    for name, most in (("tokenize", None), ("assemble", 1.5), ("lint", 3.0), ("format", None)):
        ratio = statistics.median(
            own / first for own, first in zip(times[name], times["tokenize"], strict=True)
        )
        ok = most is None or ratio <= most
        missed += not ok
        goal = "" if most is None else f", must be at most {most}  {'ok' if ok else 'MISSED'}"
        print(f"{name:<12} {middle[name]:7.1f} ms  {ratio:5.2f} times tokenize{goal}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
