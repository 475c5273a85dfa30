"""Prints what `coverage json` says of each package: lines and branches that the tests reach, in per cent."""

import json
import sys
from collections import defaultdict
from pathlib import PurePath

WANTED = {"tmcl": 100, "toolchain": 100, "firmware": 100, "chips": 100}
OTHERS = 90


def package(path: str) -> str:
    """The package that a file belongs to."""
    parts = PurePath(path).parts
    rest = parts[parts.index("tmcm34x") + 1 :]
    return rest[0] if len(rest) > 1 else "."


def main() -> None:
    """Read the report from standard input, print the table."""
    sums: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    for path, file in json.load(sys.stdin)["files"].items():
        figures = file["summary"]
        for index, name in enumerate(("covered_lines", "num_statements", "covered_branches", "num_branches")):
            sums[package(path)][index] += figures[name]
    sys.stdout.write(f"{'package':<12} {'lines':>7} {'branches':>9} {'wanted':>7}\n")
    for name, (lines, statements, branches, all_branches) in sorted(sums.items()):
        reached = 100 * lines / max(1, statements)
        ways = 100 * branches / max(1, all_branches)
        wanted = WANTED.get(name, OTHERS)
        mark = "" if reached >= wanted else "  below"
        sys.stdout.write(f"{name:<12} {reached:6.1f}% {ways:8.1f}% {wanted:6}%{mark}\n")


main()
