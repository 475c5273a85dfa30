"""Who debugs a program of his own, beside a host of his own: condition, plot, export, traffic."""

from __future__ import annotations

import csv
import itertools
from pathlib import Path
from typing import Any

from playwright.sync_api import expect

from ide.page.driver import OpenIde, arm, box_of, figure, tab, until
from tmcm34x.host import Connection
from tmcm34x.tmcl.mnemonic import parse_instruction

PROGRAM = """\
// Back and forth; the host counts the rounds
        SAP 4, 0, 400
Round:  MVP ABS, 0, 4000
        WAIT POS, 0, 0
        MVP ABS, 0, 0
        WAIT POS, 0, 0
        GGP 7, 2
        CALC ADD, 1
        AGP 7, 2
        JA Round
"""


def test_a_condition_a_plot_an_export_and_the_traffic_of_a_host(tmp_path: Path, open_ide: OpenIde):
    (tmp_path / "program.tmc").write_text(PROGRAM)
    page, ide = open_ide("--tcp", "0")
    with Connection.open(f"tcp://{ide.links[0][1]}?timeout=30") as host:
        row = box_of(page.locator(".cm-line", has_text="JA Round"))
        gutter = box_of(page.locator(".breakpoints"))
        page.mouse.click(gutter["x"] + gutter["width"] / 2, row["y"] + row["height"] / 2, button="right")
        page.get_by_role("textbox", name="Hold when").fill("gp[7] >= 3")
        page.get_by_role("button", name="Set", exact=True).click()
        expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(1)
        page.get_by_label("Speed of time").select_option("10")
        page.get_by_role("button", name="Run", exact=True).click()
        expect(page.locator(".cm-line.execution.held")).to_contain_text("JA Round")
        assert host.execute(parse_instruction("GGP 7, 2")).value == 3
        until(page, lambda: figure(page, 0, "position") == 0)

        page.get_by_role("button", name="Export").click()
        with page.expect_download() as started:
            page.get_by_role("menuitem", name="CSV table").click()
        lines = list(csv.DictReader(Path(started.value.path()).read_text().splitlines()))
        positions = [float(each["position_0"]) for each in lines if each["position_0"]]
        assert min(positions) == 0
        assert 3900 < max(positions) <= 4000
        assert sum(a < 2000 <= b for a, b in itertools.pairwise(positions)) == 3
        times = [float(each["time_s"]) for each in lines]
        assert times == sorted(times)

        tab(page, "Telegrams")
        assert host.execute(parse_instruction("SGP 7, 2, 100")).status == 100
        logged = page.locator(".telegram", has_text="SGP 7, 2, 100")
        expect(logged).to_contain_text("tcp")
        page.get_by_role("button", name="Run", exact=True).click()
        until(page, lambda: host.execute(parse_instruction("GGP 7, 2")).value == 101)
        expect(page.locator(".cm-line.execution.held")).to_contain_text("JA Round")


STATIONS = 24
WRONG = 13


def _long_program() -> str:
    """Twenty-four stations, each with a routine of its own that counts its visits; one takes the wrong motor."""
    head = ["// A row of stations", *(f"Station{n} = {20 * n + 20}" for n in range(STATIONS)), ""]
    body = ["        SAP 4, 0, 2000", "        SAP 5, 0, 2000"]
    for n in range(STATIONS):
        body += [f"// to station {n}", f"        CSUB Move{n}", f"        CSUB Count{n}"]
    body += ["        STOP", ""]
    for n in range(STATIONS):
        motor = 1 if n == WRONG else 0
        body += [
            f"Move{n}: MVP ABS, {motor}, Station{n}",
            f"        WAIT POS, {motor}, 0",
            "        RSUB",
            f"Count{n}: GGP {n}, 2",
            "        CALC ADD, 1",
            f"        AGP {n}, 2",
            "        RSUB",
            "",
        ]
    return "\n".join([*head, *body])


def test_three_hundred_lines_on_a_real_module_are_debugged(tmp_path: Path, open_ide: OpenIde, serve: Any):
    text = _long_program()
    assert 290 <= text.count("\n") <= 330
    (tmp_path / "program.tmc").write_text(text)
    served = serve("--pty", "--tcp", "127.0.0.1:0")
    with Connection.open(f"tcp://{served.tcp}?timeout=30") as observer:

        def ask(line: str) -> int:
            return observer.execute(parse_instruction(line)).value

        page, _ = open_ide("--port", served.pty)
        arm(page)
        page.keyboard.press("Control+Shift+o")
        expect(page.locator(".outline")).to_contain_text(f"Move{STATIONS - 1}")
        page.keyboard.press("Control+p")
        field = page.get_by_role("textbox", name="File or command")
        field.fill(f"Move{WRONG}")
        expect(page.get_by_role("option").first).to_contain_text(f"Move{WRONG}")
        field.press("Enter")
        line = page.locator(".cm-line", has_text=f"Move{WRONG}: MVP")
        expect(line).to_be_visible()
        page.keyboard.press("F8")
        expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(1)
        page.keyboard.press("F9")
        expect(page.locator(".cm-line.execution.held")).to_contain_text(f"Move{WRONG}")
        assert [ask(f"GGP {n}, 2") for n in (WRONG - 1, WRONG)] == [1, 0]
        until(page, lambda: ask("GAP 1, 0") == 20 * WRONG)
        expect(line.locator(".live-value")).to_have_text("position 0")
        counted = page.locator(".cm-line", has_text=f"Count{WRONG}: GGP")
        expect(counted.locator(".live-value")).to_have_text("= 0")
        page.keyboard.press("F7")
        expect(page.locator(".cm-line.execution.held")).to_contain_text("WAIT POS, 1")
        until(page, lambda: ask("GAP 1, 1") == 20 * WRONG + 20)
        assert ask("GAP 1, 0") == 20 * WRONG

        page.keyboard.press("Control+F2")
        expect(page.locator(".status-bar .pill").first).to_have_text("stopped")
        line.click()
        page.keyboard.press("F8")
        expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(0)
        page.keyboard.press("Home")
        page.keyboard.press("Shift+End")
        page.keyboard.type(f"Move{WRONG}: MVP ABS, 0, Station{WRONG}")
        page.keyboard.press("Escape")
        expect(page.locator(".status-bar")).to_contain_text("0 errors")
        stored = page.locator(".notice", has_text="instructions are in the module")
        expect(stored).to_have_count(0)
        page.keyboard.press("F6")
        expect(stored).to_have_count(1)
        page.keyboard.press("F9")
        until(page, lambda: ask(f"GGP {STATIONS - 1}, 2") == 1)
        assert ask("GAP 1, 0") == 20 * STATIONS
        assert ask(f"GGP {WRONG}, 2") == 1
        assert ask("GAP 1, 1") == 20 * WRONG + 20
