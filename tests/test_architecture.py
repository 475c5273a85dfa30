"""The rules of docs/architecture.md, checked."""

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "tmcm34x"
BELOW_SERVER = ("clock.py", "tmcl", "chips", "world", "board", "firmware", "toolchain")


def modules(*names: str) -> list[Path]:
    found = [
        path
        for name in names
        for path in ([SOURCE / name] if name.endswith(".py") else (SOURCE / name).rglob("*.py"))
    ]
    assert found
    return found


def test_imports_point_down_only():
    linter = Path(sys.executable).with_name("lint-imports")
    result = subprocess.run([linter, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout


def test_no_files_import_each_other_in_a_circle():
    """Imports for type checking and in functions count."""
    graph = grimp.build_graph("tmcm34x", cache_dir=None)
    circles = TopologicalSorter(
        {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    )
    try:
        circles.prepare()
    except CycleError as error:
        raise AssertionError(" imports ".join(reversed(error.args[1]))) from None


def test_nothing_below_the_server_opens_a_file():
    for path in modules(*BELOW_SERVER):
        calls = [
            node.lineno
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Call)
            and (
                (isinstance(node.func, ast.Name) and node.func.id in {"open", "print", "input"})
                or (
                    isinstance(node.func, ast.Attribute)
                    and node.func.attr in {"read_text", "read_bytes", "write_bytes"}
                )
            )
        ]
        assert not calls, f"{path.relative_to(ROOT)} lines {calls}"


def test_paths_of_users_are_resolved_in_one_place():
    """`Path.resolve` raises `RuntimeError` for links in a circle, and does not look behind them."""
    for path in SOURCE.rglob("*.py"):
        assert ".resolve()" not in path.read_text(), (
            f"{path.relative_to(ROOT)}: use files.followed or files.real_path"
        )
        assert "realpath(" not in path.read_text() or path.name == "files.py", path.relative_to(ROOT)


def test_no_group_of_a_pattern_is_repeated_possessively():
    """Python before 3.11.5, that of Debian 12 among them, ends such a repetition at the wrong place."""
    for path in SOURCE.rglob("*.py"):
        found = [
            node.value
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and any(sign in node.value for sign in (")*+", ")++", ")?+", "(?>"))
        ]
        assert not found, f"{path.relative_to(ROOT)}: {found}"


def test_every_module_says_what_it_is():
    for path in SOURCE.rglob("*.py"):
        docstring = ast.get_docstring(ast.parse(path.read_text()))
        assert docstring, f"{path.relative_to(ROOT)} has no docstring"
        assert "TODO" not in docstring, path.relative_to(ROOT)


def test_the_repository_stands_alone():
    """No path of somebody's machine in what users get."""
    for folder in ("src", "docs", "examples", "requirements", "benchmarks", "web", "editors"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in {
                ".py",
                ".md",
                ".toml",
                ".tmc",
                ".txt",
                ".ts",
                ".tsx",
                ".json",
                ".css",
                ".html",
            } and not ({"node_modules", "static"} & set(path.parts)):
                text = path.read_text()
                assert "../shared" not in text, path
                assert "/work/" not in text, path
