"""Writes the generated pages of the documentation; `--check` only tells whether they are fresh.

    .venv/bin/python docs/generate.py [--check]

Each entry of `PAGES` is a file and the function that gives its text.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path

import bench_page
import conformance
import fidelity_index
import host_attributes

from tmcm34x.toolchain import reference

DOCS = Path(__file__).parent
ENTRY = re.compile(r"^### ([A-Z]+-\d+) (.+)\n((?:.+\n?)+)", re.MULTILINE)

FIDELITY_HEAD = """\
# Fidelity: where the manual is silent or wrong

The manual of firmware V4.36, corrected by its errata, is the specification. This is the list of every place where it
is silent, contradicts itself or is wrong: what the manual says, what the module does, why, how sure we are, and the
test that pins it. Precedence: manual, data sheets of the chips, the vendor's published behaviour of sister modules,
what unmodified host programs rely on, judgement. **Nothing here is a measurement on a real module**, unless it says so.

Sources and errors of measurement are named in the entries; a confidence of *high* means that the vendor says it for
this line of firmware or two independent sources agree, *medium* one good source, *low* our judgement.

"""


def fidelity() -> str:
    """The index of all fidelity entries."""
    parts = [FIDELITY_HEAD]
    for path in sorted((DOCS / "fidelity").glob("*.md")):
        text = path.read_text()
        title = text.splitlines()[0].removeprefix("# Fidelity: ").removeprefix("# ")
        parts.append(
            f"## [{title[0].upper()}{title[1:]}](fidelity/{path.name})\n\n"
            "| no. | choice | confidence |\n| --- | --- | --- |\n"
        )
        for name, heading, body in ENTRY.findall(text):
            parts.append(f"| {name} | {heading} | {fidelity_index.confidence(body)} |\n")
        parts.append("\n")
    return "".join(parts).rstrip() + "\n"


def with_tables(name: str) -> Callable[[], str]:
    """A page written by hand, with the tables between its marks made anew."""
    return lambda: reference.fill((DOCS / name).read_text())


def textmate_grammar() -> str:
    """The colours of the language for VS Code, before the language server is there."""
    return json.dumps(reference.textmate_grammar(), indent=2) + "\n"


PAGES: dict[str, Callable[[], str]] = {
    "../editors/vscode/syntaxes/tmcl.tmLanguage.json": textmate_grammar,
    "language.md": with_tables("language.md"),
    "lint.md": with_tables("lint.md"),
    "fidelity.md": fidelity,
    "conformance.md": conformance.page,
    "bench.md": bench_page.page,
    "../src/tmcm34x/capture/fidelity.tsv": fidelity_index.page,
    "../src/tmcm34x/host/attributes.py": host_attributes.page,
}


def main(arguments: list[str]) -> int:
    """Write all pages, or with `--check` name the stale ones; the exit status tells."""
    stale = []
    for name, page in PAGES.items():
        path, text = DOCS / name, page()
        if not path.exists() or path.read_text() != text:
            stale.append(name)
            if "--check" not in arguments:
                path.write_text(text)
    if "--check" in arguments and stale:
        sys.stderr.write(f"stale: {', '.join(stale)}; run docs/generate.py\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
