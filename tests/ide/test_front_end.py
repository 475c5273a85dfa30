from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

from ide.front_end import NODE, WEB, built
from tmcm34x.ide import wire
from tmcm34x.ide.state import Frames, empty, put

BUDGET = 800_000
"""Bytes of the page before compression."""


def _a_value_for(code: str, number: int) -> float:
    return {"B": 200, "H": 50_000, "h": -3_000, "i": -100_000, "I": 3_000_000_000, "f": 0.5, "d": 2.0**40}[
        code
    ] + number


def test_the_pages_logic_passes_its_own_tests():
    """Runs web/test with Node's test runner, with a frame made here for the reader written in TypeScript."""
    state, expected = empty(), {}
    for group in wire.GROUPS:
        values = {row.name: _a_value_for(row.code, number) for number, row in enumerate(group.rows)}
        expected[group.name] = values
        put(state, group.name, *values.values())
    expected["watched"] = [1, None, -2]
    built()
    result = subprocess.run(
        [NODE, "test.mjs"], cwd=WEB, capture_output=True, text=True, check=False,
        env={**os.environ, "FRAME": Frames().frame(state, [1, None, -2]).hex(), "EXPECTED": json.dumps(expected)},
    )  # fmt: skip
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_page_is_typed_strictly():
    built()
    command = [NODE, "node_modules/typescript/bin/tsc", "--noEmit"]
    result = subprocess.run(command, cwd=WEB, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout


def test_the_page_is_small_and_asks_nobody_else():
    static = built()
    assert sum(file.stat().st_size for file in static.iterdir()) < BUDGET
    for name in ("index.html", "style.css"):
        text = (static / name).read_text(encoding="utf-8")
        assert "http://" not in text.replace("http://www.w3.org/", "")
        assert "https://" not in text


def test_the_lock_file_has_no_addresses_and_every_version_is_exact():
    lock = (WEB / "package-lock.json").read_text(encoding="utf-8")
    assert '"resolved"' not in lock
    package = json.loads((WEB / "package.json").read_text(encoding="utf-8"))
    for versions in (package["dependencies"], package["devDependencies"]):
        assert all(version[0].isdecimal() for version in versions.values())
    assert Path(WEB / ".npmrc").read_text(encoding="utf-8").startswith("omit-lockfile-registry-resolved=true")
