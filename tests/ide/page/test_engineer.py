"""Who debugs a program of his own, beside a host of his own: condition, plot, export, traffic."""

from __future__ import annotations

import csv
import itertools
from pathlib import Path

from playwright.sync_api import expect

from ide.page.driver import OpenIde, figure, tab, until
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
    with Connection.open(f"tcp://{ide.links[0][1]}") as host:
        row = page.locator(".cm-line", has_text="JA Round").bounding_box()
        gutter = page.locator(".breakpoints").bounding_box()
        assert row and gutter
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
