"""The connection page, the start page with its examples, the tour, and benches in the editor."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from ide.front_end import built
from ide.page.driver import COMMAND, OpenIde, arm, figure, shown, until


@pytest.fixture
def bare(tmp_path: Path, window: Callable[[str], Page]) -> Iterator[Page]:
    """The page of an IDE that was started without a file or folder, in an empty one."""
    built()
    process = subprocess.Popen(
        [COMMAND, "ide", "--no-browser"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    page = window(process.stdout.readline().split()[2])
    yield page
    page.close()
    process.terminate()
    process.stdout.close()
    process.wait(60)


def _connection(page: Page) -> None:
    page.locator(".lane .place").click()
    expect(page.get_by_role("heading", name="Connection")).to_be_visible()


def _by_hand(page: Page, port: str, address: str) -> None:
    page.get_by_role("radio", name="Serial port").click()
    page.get_by_role("combobox", name="Port", exact=True).fill(port)
    page.get_by_role("textbox", name="Address", exact=True).fill(address)
    page.get_by_role("form", name="Connect by hand").get_by_role("button", name="Connect").click()


def test_the_page_goes_to_a_real_module_and_back_and_always_says_where_it_is(serve: Any, open_ide: OpenIde):
    page, _ = open_ide()
    served = serve("--pty", "--model", "341")
    place = page.locator(".lane .place")
    expect(place).to_have_text("virtual · bare motors")
    _connection(page)
    _by_hand(page, served.pty, "7")
    trouble = page.get_by_role("alert").filter(has_text="address 7")
    expect(trouble).to_contain_text("check power, wiring, address and bit rate")
    expect(place).to_have_text("virtual · bare motors")
    expect(page.locator("header").first).to_contain_text("TMCM-343")
    _by_hand(page, served.pty, "1")
    expect(place).to_have_text(f"{served.pty}, 9600 baud, address 1")
    expect(page.locator("header").first).to_contain_text("TMCM-341")
    expect(page.get_by_role("switch", name="ARMED")).to_have_attribute("aria-checked", "false")
    expect(trouble).to_have_count(0)
    arm(page)
    page.get_by_role("button", name="Back to the virtual module").click()
    page.get_by_role("button", name="Leave it").click()
    expect(place).to_have_text("virtual · bare motors")
    expect(page.locator("header").first).to_contain_text("TMCM-343")
    recent = page.get_by_role("region", name="Recent connections")
    recent.get_by_role("button", name="Connect").click()
    expect(place).to_contain_text(served.pty)
    expect(page.get_by_role("switch", name="ARMED")).to_have_attribute("aria-checked", "false")


def _on_a_bus(page: Page, kind: str, fields: dict[str, str], reply: str) -> None:
    page.get_by_role("radio", name=kind, exact=True).click()
    for name, value in {**fields, "Module id": "1", "Reply id": reply}.items():
        page.get_by_label(name, exact=True).fill(value)
    page.get_by_role("form", name="Connect by hand").get_by_role("button", name="Connect").click()


@pytest.mark.parametrize("kind", ["SLCAN adapter", "CAN"])
def test_a_module_on_a_can_bus_is_reached_moved_and_left(serve: Any, open_ide: OpenIde, kind: str):
    """The adapter is a real one to both: to the IDE's own SLCAN, and to python-can's."""
    adapter = dict(serve("--slcan", "--model", "342").links)["slcan"]
    fields = {"Port of the adapter": adapter} if kind != "CAN" else {"Interface": "slcan", "Channel": adapter}
    page, _ = open_ide()
    place = page.locator(".lane .place")
    _connection(page)
    _on_a_bus(page, kind, fields, "9")
    expect(page.get_by_role("alert").filter(has_text="identifiers")).to_be_visible()
    expect(place).to_have_text("virtual \u00b7 bare motors")
    _on_a_bus(page, kind, fields, "2")
    expect(page.locator("header").first).to_contain_text("TMCM-342")
    expect(place).to_contain_text(adapter)
    expect(place).to_contain_text("id 1")
    arm(page)
    page.get_by_role("textbox", name="Destination of motor 2").fill("600")
    page.get_by_role("button", name="Move motor 2 to").click()
    until(page, lambda: figure(page, 2, "position") == 600)
    page.get_by_role("button", name="Back to the virtual module").click()
    page.get_by_role("button", name="Leave it").click()
    expect(place).to_have_text("virtual \u00b7 bare motors")


def test_the_editor_judges_for_the_module_that_is_there(serve: Any, open_ide: OpenIde, tmp_path: Path):
    """Parameter 206, the load, is of modules with drivers: a TMCM-342 has none."""
    (tmp_path / "program.tmc").write_text("Loop: GAP 206, 0\nAGP 1, 2\nWAIT TICKS, 0, 1\nJA Loop\n")
    page, _ = open_ide()
    complaint = page.locator(".code:not([hidden])").locator(".cm-lintRange-error, .cm-lintRange-warning")
    expect(page.locator(".status-bar")).to_contain_text("0 errors, 0 warnings")
    _connection(page)
    page.get_by_role("combobox", name="Model").select_option("342")
    page.get_by_role("button", name="Use it").click()
    expect(page.locator("header").first).to_contain_text("TMCM-342")
    page.get_by_role("tab", name="program.tmc").click()
    expect(complaint.first).to_be_visible()
    expect(page.locator(".status-bar")).not_to_contain_text("0 errors, 0 warnings")
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Assembler options").click()
    page.get_by_role("combobox", name="Assembled for").select_option("343")
    page.get_by_role("tab", name="program.tmc").click()
    expect(complaint).to_have_count(0)
    expect(page.locator(".status-bar")).to_contain_text("0 errors, 0 warnings")


def test_a_silent_module_can_be_waited_for_and_nothing_of_it_is_shown_as_known(serve: Any, open_ide: OpenIde):
    page, _ = open_ide()
    served = serve("--pty")
    _connection(page)
    _by_hand(page, served.pty, "9")
    page.get_by_role("button", name="Wait for it").click()
    expect(page.locator(".lane .place")).to_contain_text("address 9")
    expect(page.locator("header").first).to_contain_text("no module")
    expect(page.locator(".lane .banner")).to_contain_text("No answer")
    expect(page.locator(".axis.motor0 [data-figure=position]")).to_have_text("–")
    expect(page.get_by_role("region", name="Connected to")).to_contain_text("has not answered yet")
    page.get_by_role("button", name="Tools", exact=True).click()
    tool = page.locator(".tool-body")
    page.get_by_role("button", name="Reference search", exact=True).click()
    expect(page.get_by_role("combobox", name="Referencing mode").locator("option:checked")).to_have_text("–")
    expect(tool).to_contain_text("left unknown")
    expect(tool.locator("pre")).to_contain_text("SAP 193, 0, ?")
    expect(page.get_by_role("button", name="Copy to the editor")).to_be_disabled()
    page.get_by_role("button", name="Stall detection").click()
    expect(tool.locator("pre")).to_have_text("SAP 205, 0, ?")
    page.get_by_role("button", name="Unit calculator").click()
    expect(tool).to_contain_text("those of the module are unknown")


def test_a_scan_is_shown_and_its_find_is_connected_to(serve: Any, open_ide: OpenIde):
    page, _ = open_ide()
    _connection(page)
    ports = page.get_by_role("region", name="Serial ports")
    expect(ports).to_be_visible()
    expect(ports).to_contain_text("it changes nothing in a module")
    served = serve("--tcp", "127.0.0.1:0", "--model", "342")
    page.get_by_role("radio", name="TCP").click()
    page.get_by_role("textbox", name="HOST:PORT").fill(served.tcp)
    form = page.get_by_role("form", name="Connect by hand")
    form.get_by_role("button", name="Scan").click()
    module = form.locator(".module", has_text="TMCM-342")
    expect(module).to_contain_text("address 1")
    module.get_by_role("button", name="Connect").click()
    expect(page.locator(".lane .place")).to_contain_text(served.tcp)


def test_without_a_folder_the_start_page_opens_an_example_with_its_machine(bare: Page):
    expect(bare.get_by_role("heading", name="Start")).to_be_visible()
    bare.locator(".gallery .tile", has_text="Homing two axes").click()
    expect(shown(bare, "examples/homing.tmc")).to_contain_text("#include include/parameters.tmc")
    expect(bare.locator(".lane .place")).to_have_text("virtual · examples/benches/xy-stage.toml")
    expect(bare.get_by_role("tab", name="xy-stage.toml")).to_be_visible()
    expect(bare.locator(".status-bar")).to_contain_text("0 errors")
    bare.keyboard.press("F9")
    expect(bare.locator(".status-bar .pill").first).to_have_text("running")
    until(bare, lambda: figure(bare, 0, "speed") != 0)
    bare.keyboard.press("F10")


def test_the_tour_is_taken_or_skipped_and_not_offered_again(bare: Page):
    offer = bare.get_by_text("New here?")
    expect(offer).to_be_visible()
    bare.get_by_role("button", name="Take the tour Six").click()
    card = bare.get_by_role("dialog")
    expect(card).to_contain_text("Your program")
    card.get_by_role("button", name="Next").press("Enter")
    expect(card).to_contain_text("Run it")
    card.get_by_role("button", name="Back").click()
    expect(card).to_contain_text("Your program")
    bare.keyboard.press("Escape")
    expect(card).to_have_count(0)
    expect(offer).to_have_count(0)
    bare.reload()
    expect(bare.get_by_role("heading", name="Start")).to_be_visible()
    expect(offer).to_have_count(0)
    bare.get_by_role("button", name="Take the tour Six").click()
    for _ in range(5):
        card.get_by_role("button", name="Next").click()
    expect(card).to_contain_text("STOP ALL")
    card.get_by_role("button", name="Done").click()
    expect(card).to_have_count(0)


COLOUR = "name = 5"
STAGE = """\
[[module]]
model = 340

[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0, low = -2.0, high = 202.0, start = 60.0 }
"""


def test_a_bench_is_checked_completed_and_used_in_the_editor(tmp_path: Path, open_ide: OpenIde):
    (tmp_path / "stage.toml").write_text(STAGE + COLOUR)
    page, _ = open_ide()
    page.get_by_role("treeitem", name="stage.toml").click()
    text = shown(page, "stage.toml")
    bar = page.get_by_role("region", name="Bench file")
    expect(bar).to_contain_text("line 2: module[0].model")
    expect(bar.get_by_role("button", name="Use this bench")).to_be_disabled()
    expect(page.locator(".code:not([hidden]) .cm-lintRange-error").first).to_have_text("340")
    page.get_by_role("tab", name="Problems").click()
    expect(page.locator(".problem")).to_have_count(2)
    expect(bar).to_contain_text("2 mistakes")
    text.press("Control+End")
    for _ in range(len(COLOUR)):
        text.press("Backspace")
    expect(page.locator(".problem")).to_have_count(1)
    text.press("Control+Home")
    text.press("ArrowDown")
    text.press("End")
    for _ in range(3):
        text.press("Backspace")
    text.press("Control+Space")
    page.locator(".cm-tooltip-autocomplete li", has_text="341").click()
    expect(bar).to_contain_text("no mistakes")
    bar.get_by_role("button", name="Use this bench").click()
    expect(page.locator(".lane .place")).to_have_text("virtual · stage.toml")
    expect(page.locator("header").first).to_contain_text("TMCM-341")
    text.press("Control+End")
    page.keyboard.type("switch.le")
    expect(page.locator(".cm-tooltip-autocomplete li", has_text="left")).to_be_visible()
    page.keyboard.press("Escape")


def test_other_toml_files_are_no_programs_and_no_benches(tmp_path: Path, open_ide: OpenIde):
    (tmp_path / "settings.toml").write_text("model = 343\n[axis.0]\nmax_speed = 5\n")
    page, _ = open_ide()
    page.get_by_role("treeitem", name="settings.toml").click()
    expect(shown(page, "settings.toml")).to_contain_text("max_speed")
    expect(page.locator(".status-bar")).to_contain_text("0 errors")
    expect(page.get_by_role("region", name="Bench file")).to_have_count(0)
    page.keyboard.press("F6")
    expect(page.locator(".status-bar")).to_contain_text("/ 2048")
    expect(page.locator(".notice.error")).to_have_count(0)
