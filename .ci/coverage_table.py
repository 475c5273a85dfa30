"""Prints what `coverage json` says of each package: lines and branches that the tests reach, in per cent.

Ends with status 1 where a package reaches fewer lines than wanted; names the lines of packages that must reach all.
"""

import json
import sys
from collections import defaultdict
from pathlib import PurePath

WANTED = {"tmcl": 100, "toolchain": 100, "firmware": 100, "chips": 100}
OTHERS = 90
COLUMNS = ("covered_lines", "num_statements", "covered_branches", "num_branches")


def package(path: str) -> str:
    """The package that a file belongs to."""
    parts = PurePath(path).parts
    rest = parts[parts.index("tmcm34x") + 1 :]
    return rest[0] if len(rest) > 1 else "."


def main() -> int:
    """Read the report from standard input, print the table; the exit status."""
    files = json.load(sys.stdin)["files"]
    sums: dict[str, list[int]] = defaultdict(lambda: [0] * len(COLUMNS))
    for path, file in files.items():
        for index, name in enumerate(COLUMNS):
            sums[package(path)][index] += file["summary"][name]
    print(f"{'package':<14} {'lines':>7} {'branches':>9} {'wanted':>7}")
    below = False
    for name, (lines, statements, branches, all_branches) in sorted(sums.items()):
        reached = 100 * lines / max(1, statements)
        ways = 100 * branches / max(1, all_branches)
        wanted = WANTED.get(name, OTHERS)
        below = below or reached < wanted
        print(f"{name:<14} {reached:6.1f}% {ways:8.1f}% {wanted:6}%{'  below' if reached < wanted else ''}")
    for path, file in sorted(files.items()):
        if package(path) in WANTED and file["missing_lines"]:
            print(f"not reached: {path}: {', '.join(map(str, file['missing_lines']))}")
    return int(below)


if __name__ == "__main__":
    sys.exit(main())
