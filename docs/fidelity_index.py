"""Writes src/tmcm34x/capture/fidelity.tsv: which commands and parameters each fidelity entry names."""

from __future__ import annotations

import re
from pathlib import Path

from tmcm34x.tmcl.commands import BY_MNEMONIC, CONTROL_FUNCTIONS

FRAGMENTS = Path(__file__).parent / "fidelity"
ENTRY = re.compile(r"^### ([A-Z]+-\d+) (.+)\n((?:.+\n?)+)", re.MULTILINE)
CONFIDENCE = re.compile(r"(?<=[.;:] )(High|Medium|Low)\b")
"""The word that a sentence about the confidence begins with."""
PARAMETERS = re.compile(r"\b(global )?parameters? ((?:\d+(?:,? (?:and|to) |, )?)+)", re.IGNORECASE)
TOOLS = frozenset({"IDE", "TOOL", "DBG"})
"""Entries about tools, which no telegram touches."""
CONTROL = frozenset(row.number for row in CONTROL_FUNCTIONS)


def keys(text: str) -> set[str]:
    """`GAP`, `AP.206`, `GP.75`, `138` of a text."""
    found = {word for word in re.findall(r"\b[A-Z][A-Z0-9]+\b", text) if word in BY_MNEMONIC}
    for is_global, numbers in PARAMETERS.findall(text):
        for number in re.findall(r"\d+", numbers):
            found |= {f"GP.{number}"} if is_global else {f"AP.{number}", f"GP.{number}"}
    return found | {number for number in re.findall(r"\b1[23]\d\b", text) if int(number) in CONTROL}


def confidence(body: str) -> str:
    """`high`, `medium` or `low`: the first one that an entry states."""
    _, stated = body.split("Why:")
    return CONFIDENCE.findall(stated)[0].lower()


def page() -> str:
    """The table."""
    rows = ["# number, title, confidence, commands and parameters; made by docs/generate.py"]
    for path in sorted(FRAGMENTS.glob("*.md")):
        for number, title, body in ENTRY.findall(path.read_text()):
            if number.split("-")[0] in TOOLS:
                continue
            words = " ".join(sorted(keys(f"{title}\n{body.split('Pinned by')[0]}")))
            rows.append(f"{number}\t{title}\t{confidence(body)}\t{words}")
    return "\n".join(rows) + "\n"
