"""What the documents promise is there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FRAGMENTS = sorted((ROOT / "docs" / "fidelity").glob("*.md"))
ENTRY = re.compile(r"^### ([A-Z]+-\d+) (.+)\n((?:.+\n?)+)", re.MULTILINE)


def entries(path: Path) -> list[tuple[str, str, dict[str, str]]]:
    return [
        (name, title, dict(line.split(": ", 1) for line in body.strip().splitlines() if ": " in line))
        for name, title, body in ENTRY.findall(path.read_text())
    ]


@pytest.mark.parametrize("path", FRAGMENTS, ids=lambda path: path.stem)
def test_every_fidelity_entry_is_complete_and_pinned_by_a_test_that_exists(path):
    found = entries(path)
    assert found
    for name, title, fields in found:
        assert set(fields) >= {"Manual", "Module", "Why", "Pinned by"}, f"{name} {title}: {sorted(fields)}"
        assert re.search(r"[.;:] (High|Medium|Low)\b", fields["Why"]), f"{name}: how sure?"
        for pin in re.split(r",\s*", fields["Pinned by"]):
            file_name, _, test = pin.strip("` ").partition("::")
            target = ROOT / file_name
            assert target.exists(), f"{name}: {file_name}"
            assert not test or f"def {test.split('::')[-1].split('[')[0]}" in target.read_text(), (
                f"{name}: {pin}"
            )


def test_fidelity_numbers_are_unique():
    names = [name for path in FRAGMENTS for name, _, _ in entries(path)]
    assert len(names) == len(set(names))


def test_numbers_cited_in_the_source_exist():
    known = {name for path in FRAGMENTS for name, _, _ in entries(path)}
    for path in (ROOT / "src").rglob("*.py"):
        for cited in re.findall(r"\b((?:TMCL|CHIP|FW|PROG|WORLD|WIRE|TOOL|IDE|DBG)-\d+)\b", path.read_text()):
            assert cited in known, f"{path.relative_to(ROOT)} cites {cited}"


def test_the_changelog_names_the_version():
    version = re.search(r'__version__ = "(.+)"', (ROOT / "src/tmcm34x/__init__.py").read_text()).group(1)
    assert f"## {version}" in (ROOT / "CHANGELOG.md").read_text()


def test_generated_pages_are_fresh():
    result = subprocess.run(
        [sys.executable, ROOT / "docs" / "generate.py", "--check"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
