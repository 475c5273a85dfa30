"""The page with a module at the end of a line: serial port and TCP."""

from __future__ import annotations

import re
import subprocess
from typing import Any

from playwright.sync_api import expect

from ide.page.driver import COMMAND, OpenIde, arm, figure, line, tab, until


def test_a_module_on_a_serial_line_runs_steps_and_stops(serve: Any, open_ide: OpenIde):
    port = serve("--pty").pty
    page, _ = open_ide("--port", port)
    expect(page.locator("header").first).to_contain_text("TMCM-343")
    arm(page)
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    until(page, lambda: figure(page, 0, "speed") == 500)
    page.keyboard.press("F2")
    expect(page.locator(".status-bar .pill").first).to_have_text("held")
    page.keyboard.press("F7")
    expect(page.locator(".cm-line.execution.held")).to_be_visible()
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    expect(page.locator(".notice")).to_contain_text("real module")
    page.get_by_role("tab", name=re.compile("Program")).click()
    field = page.get_by_role("textbox", name="New watch")
    field.fill("ap[target_speed][0] * 2")
    field.press("Enter")
    expect(page.get_by_role("textbox", name="Value of ap[target_speed][0] * 2")).to_have_value("1000")
    page.keyboard.press("F10")
    tab(page, "Axes")
    until(page, lambda: figure(page, 0, "speed") == 0)
    tab(page, "Bench")
    expect(page.locator(".empty", has_text="real module")).to_be_visible()
    result = subprocess.run(
        [COMMAND, "ide", "--no-browser", "--port", port],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)
    assert "another program is using it" in result.stderr


def test_a_pulled_plug_is_told_and_mended_and_the_text_stays(serve: Any, open_ide: OpenIde):
    served = serve("--tcp", "127.0.0.1:0")
    page, _ = open_ide("--port", f"tcp://{served.tcp}")
    tab(page, "Direct mode")
    line(page, "GAP 4, 0")
    expect(page.locator(".answers .value").first).to_have_text("1000")
    served.stop()
    expect(page.locator(".banner")).to_contain_text("was lost")
    line(page, "GAP 4, 1")
    expect(page.locator(".answers .bad")).to_have_count(1)
    page.locator(".cm-content").press("Control+Home")
    page.keyboard.type("// meanwhile\n")
    serve("--tcp", served.tcp)
    expect(page.locator(".banner")).to_have_count(0)
    expect(page.locator(".cm-content")).to_contain_text("// meanwhile")
    line(page, "SAP 4, 2, 777")
    page.get_by_role("button", name="Parameters", exact=True).click()
    field = page.get_by_role("textbox", name="maximum positioning speed of motor 2")
    expect(field).to_have_value("777")


def test_an_upload_does_not_take_the_caret_from_a_field(serve: Any, open_ide: OpenIde):
    served = serve("--tcp", "127.0.0.1:0", "--pace")
    page, _ = open_ide("--port", f"tcp://{served.tcp}")
    arm(page)
    page.keyboard.press("F6")
    expect(page.locator(".notice").first).to_contain_text("instructions are in the module")
    page.get_by_role("button", name="Upload and disassemble").click()
    field = page.get_by_role("textbox", name="Destination of motor 2")
    field.fill("15")
    source = page.locator(".code:not([hidden]) .cm-content")
    expect(source).to_contain_text("Sub4:")
    # Longer than an editor waits that was hidden.
    page.evaluate("() => new Promise(done => setTimeout(done, 200))")
    page.keyboard.type("00")
    expect(field).to_have_value("1500")


def test_a_module_s_settings_program_and_motion_are_reached_over_tcp(serve: Any, open_ide: OpenIde):
    page, _ = open_ide("--port", f"tcp://{serve('--model', '341', '--tcp', '127.0.0.1:0').tcp}")
    expect(page.locator("header").first).to_contain_text("TMCM-341")
    arm(page)
    page.keyboard.press("F6")
    expect(page.locator(".notice").first).to_contain_text("instructions are in the module")
    page.get_by_role("button", name="Upload and disassemble").click()
    expect(page.locator(".code:not([hidden]) .cm-content")).to_contain_text("ROR 0, 500")
    page.get_by_role("textbox", name="Destination of motor 2").fill("1500")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Move motor 2 to").click()
    until(page, lambda: figure(page, 2, "position") == 1500)
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Firmware and reset").click()
    expect(page.locator(".tool-body")).to_contain_text(re.compile("341.*V4.36"))
