"""Texts from files, modules, hosts and benches that try to become HTML: they stay texts on every screen."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Page, expect

from ide.page.driver import OpenIde, line, rest_on, tab
from tmcm34x.host import Connection
from tmcm34x.tmcl.mnemonic import parse_instruction

ATTACK = "<img src=x onerror=window.attacked=1><script>window.attacked=1</script>"
NAME = "a<img src=x onerror=window.attacked=1>.tmc"
"""As much of it as the name of a file can hold."""
PROGRAM = f"""\
// {ATTACK}
#include "{ATTACK}"
Label: MVP ABS, 0, {ATTACK}
"{ATTACK}" = 5
{ATTACK}: STOP
"""
BENCH = f"""
title = {ATTACK!r}
[[module]]
[[module.axis]]
load = {{ kind = "carriage", mass_kg = 1.0 }}
"""


def attacked(page: Page) -> bool:
    return page.evaluate("() => window.attacked === 1 || document.querySelector('img[src=x]') !== null")


def test_texts_stay_texts(tmp_path: Path, open_ide: OpenIde):
    (tmp_path / "program.tmc").write_text(PROGRAM)
    (tmp_path / NAME).write_text(PROGRAM)
    bench = tmp_path / "bench.toml"
    bench.write_text(BENCH)
    page, ide = open_ide("--tcp", "0", "--bench", str(bench))
    expect(page.locator(".cm-lintRange-error").first).to_be_visible()
    page.get_by_role("treeitem", name=NAME).click()
    expect(page.locator(f".code:not([hidden])[data-path={NAME!r}] .cm-content")).to_be_visible()
    tab(page, "Direct mode")
    line(page, ATTACK)
    line(page, f"GAP {ATTACK}, 0")
    tab(page, "Program")
    for name in ("Axes", "Bench", "Telegrams"):
        tab(page, name)
    with Connection.open(f"tcp://{ide.links[0][1]}?timeout=30") as host:
        host.execute(parse_instruction("SGP 7, 2, 1"))
    expect(page.locator(".telegram", has_text="SGP 7, 2, 1").first).to_be_visible()
    page.get_by_role("tab", name="Problems").click()
    expect(page.locator(".problem").filter(has_text="onerror").first).to_be_visible()
    rest_on(page.locator(".cm-lintRange-error:visible").first, page.locator(".cm-tooltip").first)
    page.keyboard.press("Control+p")
    page.keyboard.type("onerror")
    expect(page.get_by_role("dialog").or_(page.locator(".palette")).first).to_be_visible()
    page.keyboard.press("Escape")
    assert not attacked(page)
