"""Results as JUnit XML, which CI servers show."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from tmcm34x.bench.session.errors import SessionFailedError

if TYPE_CHECKING:
    from tmcm34x.bench.session.runner import CaseResult


def junit(results: Sequence[CaseResult]) -> str:
    """The document: a suite for each file, a test for each case, model and kind of line."""
    root = ET.Element("testsuites", name="tmcm34x play")
    for path, group in groupby(results, lambda result: result.case.path):
        _add_suite(root, path, list(group))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add_suite(root: ET.Element, path: Path, results: Sequence[CaseResult]) -> None:
    failures = sum(result.error is not None for result in results)
    skipped = sum(not result.lines for result in results)
    suite = ET.SubElement(
        root, "testsuite", name=path.name, tests=str(len(results)), failures=str(failures), errors="0",
        skipped=str(skipped),
    )  # fmt: skip
    for result in results:
        _add_case(suite, result)


def _add_case(suite: ET.Element, result: CaseResult) -> None:
    case = result.case
    element = ET.SubElement(
        suite, "testcase", classname=case.path.stem, name=result.name, file=str(case.path), line=str(case.line)
    )  # fmt: skip
    if result.error is not None:
        failure = ET.SubElement(element, "failure", message=str(result.error))
        failure.text = (
            result.error.report() if isinstance(result.error, SessionFailedError) else str(result.error)
        )
    elif not result.lines:
        ET.SubElement(element, "skipped", message="needs a bench")
