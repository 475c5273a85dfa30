"""The page in Chromium, feature by feature, on a virtual module."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright
from websockets.sync.client import connect

from ide.front_end import built

expect.set_options(timeout=10_000)
COMMAND = str(Path(sys.executable).with_name("tmcm34x"))
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip

PROGRAM = """\
// Two motors
Speed = 500
        ROR 0, Speed
Loop:   CALC ADD, 1
        CSUB Rest
        JA Loop
Rest:   WAIT TICKS, 0, 2
        RSUB
"""


class Ide:
    """`tmcm34x ide` on a folder of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        built()
        self.folder = folder
        self.process = subprocess.Popen(
            [COMMAND, "ide", str(folder / "program.tmc"), "--no-browser", *options],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        ready, kind, self.url = self.process.stdout.readline().split()
        assert (ready, kind) == ("ready", "ide")

    def stop(self) -> None:
        self.process.terminate()
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.process.wait(10)


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    executable = shutil.which("chromium")
    assert executable, "install Debian's chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ide]:
    folder = tmp_path_factory.mktemp("work")
    (folder / "program.tmc").write_text(PROGRAM)
    ide = Ide(folder)
    yield ide
    ide.stop()


@pytest.fixture
def ide(shared: Ide) -> Ide:
    """The shared server as on its first day: folder, module and bench."""
    for file in shared.folder.iterdir():
        file.unlink()
    (shared.folder / "program.tmc").write_text(PROGRAM)
    calls = [
        {"call": "set_breakpoints", "breakpoints": []},
        {"call": "set_time", "paused": False, "speed": 1},
        {"call": "set_bench", "what": "line", "index": 0, "value": 1},
        {"call": "stop_all"},
        {"call": "execute", "number": 137, "value": 1234},
        *(
            {"call": "set_bench", "what": side, "index": n, "value": 0}
            for side in ("left", "right")
            for n in range(3)
        ),
        *({"call": "set_bench", "what": "input", "index": n, "value": 0} for n in range(8)),
        {"call": "set_bench", "what": "power", "index": 0, "value": 0},
        {"call": "set_bench", "what": "power", "index": 0, "value": 1},
    ]
    origin, token = shared.url.split("/?token=")
    cookie = {"Cookie": f"tmcm34x-{origin.rpartition(':')[2]}={token}"}
    with connect(f"ws{origin[4:]}/wire", origin=origin, additional_headers=cookie, proxy=None) as socket:
        for number, call in enumerate(calls, 1):
            socket.send(json.dumps([number, call]))
            while not _is_answer(socket.recv(timeout=10), number):
                pass
    return shared


def _is_answer(message: str | bytes, number: int) -> bool:
    return isinstance(message, str) and json.loads(message).get("id") == number


@pytest.fixture
def page(ide: Ide, chromium: Browser) -> Iterator[Page]:
    context = chromium.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(10_000)
    troubles: list[str] = []
    foreign: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: foreign.append(request.url) if not _local(request.url) else None)
    page.goto(ide.url)
    expect(page.locator(".cm-content")).to_be_visible()
    yield page
    context.close()
    assert troubles == []
    assert foreign == []


def _local(url: str) -> bool:
    return url.startswith(("http://127.0.0.1:", "data:", "blob:"))


def _figure(page: Page, motor: int, name: str) -> int:
    text = page.locator(f".axis.motor{motor} [data-figure={name}]").inner_text()
    return int(text.replace("\u2009", "").replace("\u2212", "-"))


def _until(page: Page, holds: Callable[[], bool], tries: int = 200) -> None:
    for _ in range(tries):
        if holds():
            return
        page.wait_for_timeout(25)
    raise AssertionError("it never came")


def _tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def _line(page: Page, text: str) -> None:
    """Send a line in direct mode."""
    field = page.get_by_role("textbox", name="Command line")
    field.fill(text)
    field.press("Enter")


def _paste(page: Page, text: str) -> None:
    page.locator(".cm-content").evaluate(
        """(element, text) => {
            const clipboardData = new DataTransfer();
            clipboardData.setData("text/plain", text);
            element.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        }""",
        text,
    )


# Program and editor


def test_one_click_runs_the_program_and_another_stops_it(page: Page):
    page.get_by_role("button", name="Run", exact=True).click()
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    _until(page, lambda: _figure(page, 0, "speed") == 500)
    page.get_by_role("button", name="Stop", exact=True).first.click()
    expect(page.locator(".status-bar .pill").first).to_have_text("stopped")
    assert _figure(page, 0, "speed") == 500
    page.keyboard.press("F10")
    _until(page, lambda: _figure(page, 0, "speed") == 0)


def test_a_changed_speed_runs_at_the_next_click(page: Page, ide: Ide):
    page.get_by_text("Speed = ").click()
    page.keyboard.press("End")
    page.keyboard.press("Backspace")
    page.keyboard.press("F9")
    _until(page, lambda: _figure(page, 0, "speed") == 50)
    assert "Speed = 50\n" in (ide.folder / "program.tmc").read_text()


def test_a_breakpoint_holds_and_steps_move_the_line(page: Page):
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(1)
    _tab(page, "Program")
    page.keyboard.press("F9")
    expect(page.locator(".cm-line.execution.held")).to_contain_text("CSUB Rest")
    accumulator = page.get_by_role("textbox", name="accumulator")
    expect(accumulator).to_have_value("1")
    page.keyboard.press("F7")
    expect(page.locator(".cm-line.execution.held")).to_contain_text("WAIT TICKS")
    expect(page.locator(".stack li")).to_have_count(2)
    page.keyboard.press("Control+F7")
    expect(page.locator(".cm-line.execution.held")).to_contain_text("JA Loop")
    page.keyboard.press("F9")
    expect(accumulator).to_have_value("2")
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")


def test_a_mistake_is_underlined_listed_and_found_by_a_click(page: Page):
    page.get_by_text("JA Loop").click()
    page.keyboard.press("End")
    page.keyboard.type("X")
    expect(page.locator(".cm-lintRange-error").first).to_be_visible()
    page.get_by_role("tab", name=re.compile("Problems")).click()
    problem = page.locator(".problem.error").first
    expect(problem).to_contain_text("program.tmc:6")
    page.locator(".cm-content").press("Control+Home")
    problem.click()
    expect(page.locator(".cm-activeLine")).to_contain_text("JA LoopX")
    page.keyboard.press("F9")
    expect(page.locator(".notice.error")).to_be_visible()
    expect(page.locator(".status-bar .pill").first).to_have_text("stopped")


def test_the_language_server_completes_explains_and_mends(page: Page):
    expect(page.get_by_text("language server", exact=True)).to_be_visible()
    page.locator(".cm-content").press("Control+End")
    page.keyboard.type("SAP ", delay=20)
    expect(page.locator(".cm-tooltip-autocomplete")).to_contain_text("maximum positioning speed")
    page.keyboard.press("Escape")
    page.keyboard.type("4, 0, 1\nMWP ABS, 0, 5")
    expect(page.locator(".inlay", has_text="maximum positioning speed")).to_be_visible()
    page.locator(".cm-lintRange-error").last.hover()
    page.get_by_role("button", name="Change to MVP").click()
    expect(page.locator(".cm-content")).to_contain_text("MVP ABS, 0, 5")
    expect(page.locator(".cm-lintRange-error")).to_have_count(0)
    page.locator(".cm-line", has_text="JA Loop").get_by_text("JA").hover()
    expect(page.locator(".cm-tooltip-hover")).to_contain_text("jump always")


def test_watches_and_registers_are_seen_and_changed(page: Page):
    _tab(page, "Program")
    field = page.get_by_role("textbox", name="New watch")
    field.fill("gp[7] * 2")
    field.press("Enter")
    expect(page.get_by_role("textbox", name="Value of gp[7] * 2")).to_have_value("0")
    variable = page.get_by_role("textbox", name="User variable 7")
    variable.fill("21")
    variable.press("Enter")
    expect(page.get_by_role("textbox", name="Value of gp[7] * 2")).to_have_value("42")
    register = page.get_by_role("textbox", name="accumulator")
    register.fill("-9")
    register.press("Enter")
    expect(page.locator(".status-bar")).to_contain_text("accumulator -9")
    page.get_by_role("button", name="ETO").click()
    expect(page.get_by_role("button", name="ETO")).to_have_attribute("aria-pressed", "true")


def test_unsaved_text_is_marked_saved_by_key_and_kept_over_a_reload(page: Page, ide: Ide):
    page.locator(".cm-content").press("Control+Home")
    page.keyboard.type("// hello\n")
    expect(page.locator(".tab .dot")).to_be_visible()
    page.wait_for_timeout(500)
    page.reload()
    expect(page.locator(".cm-content")).to_contain_text("// hello")
    expect(page.locator(".tab .dot")).to_be_visible()
    assert "hello" not in (ide.folder / "program.tmc").read_text()
    page.keyboard.press("Control+s")
    expect(page.locator(".tab .dot")).to_have_count(0)
    assert (ide.folder / "program.tmc").read_text().startswith("// hello\n")


def test_a_change_from_outside_is_taken_or_asked_about(page: Page, ide: Ide):
    (ide.folder / "program.tmc").write_text("STOP // from outside\n")
    expect(page.locator(".cm-content")).to_contain_text("from outside")
    page.locator(".cm-content").press("Control+Home")
    page.keyboard.type("// mine\n")
    (ide.folder / "program.tmc").write_text("STOP // again\n")
    expect(page.locator(".outside")).to_contain_text("changed outside")
    expect(page.locator(".cm-content")).to_contain_text("// mine")
    page.get_by_role("button", name="Take the file").click()
    expect(page.locator(".cm-content")).to_contain_text("again")
    (ide.folder / "program.tmc").unlink()
    expect(page.locator(".outside")).to_contain_text("deleted")
    page.get_by_role("button", name="Save it again").click()
    expect(page.locator(".outside")).to_have_count(0)
    assert (ide.folder / "program.tmc").read_text() == "STOP // again\n"


def test_a_new_program_is_written_saved_and_renamed(page: Page, ide: Ide):
    page.keyboard.press("Alt+n")
    expect(page.get_by_role("tab", name="program2.tmc")).to_be_visible()
    page.locator(".code:not([hidden]) .cm-content").click()
    page.keyboard.type("STOP\n")
    page.keyboard.press("Control+s")
    expect(page.locator(".tab .dot")).to_have_count(0)
    assert (ide.folder / "program2.tmc").read_text().startswith("STOP")
    page.get_by_role("treeitem", name="program2.tmc").dblclick()
    page.locator(".rename").fill("other.tmc")
    page.locator(".rename").press("Enter")
    expect(page.get_by_role("tab", name="other.tmc")).to_be_visible()
    _until(page, (ide.folder / "other.tmc").exists)


def test_a_field_keeps_what_is_typed_while_the_page_moves_on(page: Page, ide: Ide):
    page.get_by_role("treeitem", name="program.tmc").dblclick()
    page.locator(".rename").fill("half a na")
    (ide.folder / "other.tmc").write_text("STOP\n")
    expect(page.get_by_role("treeitem", name="other.tmc")).to_be_visible()
    expect(page.locator(".rename")).to_have_value("half a na")
    page.keyboard.press("Escape")
    _tab(page, "Program")
    field = page.get_by_role("textbox", name="New watch")
    field.fill("time_ms")
    field.press("Enter")
    watch = page.get_by_role("textbox", name="Watch 0")
    watch.fill("half an expr")
    value = page.get_by_role("textbox", name="Value of time_ms")
    before = value.input_value()
    _until(page, lambda: value.input_value() != before)
    expect(watch).to_have_value("half an expr")


def test_find_and_replace_undo_and_the_palette(page: Page):
    page.locator(".cm-content").click()
    page.keyboard.press("Control+f")
    page.locator(".cm-search [name=search]").fill("Loop")
    page.locator(".cm-search input[name=replace]").fill("Round")
    page.locator(".cm-search [name=replaceAll]").click()
    expect(page.locator(".cm-content")).to_contain_text("Round:")
    page.keyboard.press("Escape")
    page.locator(".cm-content").press("Control+z")
    expect(page.locator(".cm-content")).to_contain_text("Loop:")
    page.keyboard.press("Control+p")
    page.keyboard.type("listing")
    page.keyboard.press("Enter")
    expect(page.locator(".listing h2")).to_have_text("program.tmc")
    expect(page.locator(".listing-line").nth(0)).to_contain_text("01 00 00 00 00 01 f4 f6")


def test_upload_gives_source_in_a_new_page(page: Page):
    page.keyboard.press("F6")
    expect(page.locator(".notice").first).to_contain_text("instructions are in the module")
    page.get_by_role("button", name="Upload and disassemble").click()
    expect(page.get_by_role("tab", name="uploaded.tmc")).to_be_visible()
    expect(page.locator(".code:not([hidden]) .cm-content")).to_contain_text("ROR 0, 500")


# Axes and bench


def test_a_motor_is_jogged_while_held_moved_and_zeroed(page: Page):
    right = page.get_by_role("button", name="Jog motor 1 right")
    right.hover()
    page.mouse.down()
    _until(page, lambda: _figure(page, 1, "speed") == 400)
    page.mouse.up()
    _until(page, lambda: _figure(page, 1, "speed") == 0)
    right.focus()
    page.keyboard.down("Space")
    _until(page, lambda: _figure(page, 1, "speed") == 400)
    page.keyboard.up("Space")
    _until(page, lambda: _figure(page, 1, "speed") == 0)
    page.get_by_role("textbox", name="Destination of motor 1").fill("-2500")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Move motor 1 to").click()
    _until(page, lambda: _figure(page, 1, "position") == -2500)
    page.get_by_role("button", name="Zero motor 1").click()
    _until(page, lambda: _figure(page, 1, "position") == 0)
    expect(page.locator(".axis.motor1 .state")).not_to_have_text("no power")


def test_a_dial_turns_with_the_rotor(page: Page):
    rotor = page.locator(".dial.motor2 .rotor")
    _tab(page, "Direct mode")
    _line(page, "ROR 2, 300")
    first = rotor.get_attribute("style")
    _until(page, lambda: rotor.get_attribute("style") != first)


def test_a_closed_limit_switch_stops_the_motor(page: Page):
    _tab(page, "Direct mode")
    _line(page, "ROR 2, 300")
    _until(page, lambda: _figure(page, 2, "speed") == 300)
    _tab(page, "Bench")
    page.get_by_role("button", name="right switch of motor 2").click()
    expect(page.get_by_role("button", name="right switch of motor 2")).to_have_attribute(
        "aria-pressed", "true"
    )
    _tab(page, "Axes")
    _until(page, lambda: _figure(page, 2, "speed") == 0)
    expect(page.locator(".axis.motor2").get_by_role("img", name="right switch on")).to_be_visible()


def test_inputs_outputs_power_and_line_are_at_the_bench(page: Page):
    _tab(page, "Bench")
    _tab(page, "Direct mode")
    page.get_by_role("switch", name="Input 3").click()
    _line(page, "GIO 3, 0")
    expect(page.locator(".answers .value").first).to_have_text("1")
    _line(page, "SIO 5, 2, 1")
    expect(page.get_by_role("img", name="output 5 on")).to_be_visible()
    page.get_by_role("button", name="Line", exact=True).click()
    _line(page, "GAP 1, 0")
    expect(page.locator(".answers .result").first).to_contain_text("unplugged")
    page.get_by_role("button", name="Line", exact=True).click()
    page.get_by_role("button", name="Power", exact=True).click()
    expect(page.locator(".banner")).to_contain_text("no power")
    page.get_by_role("button", name="Power", exact=True).click()
    expect(page.locator(".banner")).to_have_count(0)


def _seconds(clock: str) -> float:
    hours, minutes, seconds = clock.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds)


def test_time_is_held_stepped_and_hurried(page: Page):
    page.get_by_role("button", name="Hold time").click()
    clock = page.locator(".virtual-time.held")
    before = clock.inner_text()
    page.get_by_role("button", name="One millisecond").click()
    _until(page, lambda: clock.inner_text() != before)
    parts = [text.replace(":", "").replace(".", "") for text in (before, clock.inner_text())]
    assert int(parts[1]) - int(parts[0]) == 1
    page.get_by_label("Speed of time").select_option("100")
    page.get_by_role("button", name="Hold time").click()
    running = page.locator(".virtual-time:not(.held)")
    start = _seconds(running.inner_text())
    _until(page, lambda: _seconds(running.inner_text()) > start + 60, 400)


# Direct mode, log, parameters


def test_direct_mode_by_form_by_line_and_from_history(page: Page):
    _tab(page, "Direct mode")
    page.get_by_label("Instruction", exact=True).select_option("5")
    page.get_by_label("parameter of SAP").select_option("4")
    page.get_by_label("motor of SAP").fill("1")
    page.get_by_label("value of SAP").fill("777")
    page.get_by_role("button", name="Execute").click()
    expect(page.locator(".answers .command").first).to_have_text("SAP 4, 1, 777")
    expect(page.locator(".answers .bytes").first).to_contain_text("01 05 04 01 00 00 03 09 17")
    _line(page, "GAP 4, 1")
    expect(page.locator(".answers .command").first).to_have_text("GAP 4, 1")
    expect(page.locator(".answers .value").first).to_have_text("777")
    field = page.get_by_role("textbox", name="Command line")
    field.press("ArrowUp")
    expect(field).to_have_value("GAP 4, 1")
    field.press("ArrowUp")
    expect(field).to_have_value("SAP 4, 1, 777")
    _line(page, "NONSENSE")
    expect(page.locator(".notice.error")).to_contain_text("unknown command")
    page.get_by_role("button", name="Copy to the editor").last.click()
    expect(page.locator(".cm-content")).to_contain_text("SAP 4, 1, 777")


def test_the_log_shows_and_filters_telegrams(page: Page):
    _tab(page, "Telegrams")
    expect(page.locator(".telegram").first).to_be_visible()
    page.get_by_title("Forget all lines").click()
    expect(page.locator(".telegram")).to_have_count(0)
    _tab(page, "Direct mode")
    _line(page, "MVP ABS, 1, 9000")
    _line(page, "SAP 4, 7, 1")
    expect(page.locator(".answers tr.bad")).to_have_count(1)
    _tab(page, "Telegrams")
    expect(page.locator(".telegram")).to_have_count(4)
    page.get_by_role("textbox", name="Filter telegrams").fill("mvp")
    expect(page.locator(".telegram")).to_have_count(1)
    expect(page.locator(".telegram .text")).to_contain_text("MVP ABS, 1, 9000")
    page.get_by_role("textbox", name="Filter telegrams").fill("-mvp")
    expect(page.locator(".telegram")).to_have_count(3)


def test_parameters_are_searched_changed_marked_and_exported(page: Page):
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("textbox", name="Search parameters").fill("positioning speed")
    expect(page.locator("table.parameters tbody tr")).to_have_count(2)
    field = page.get_by_role("textbox", name="maximum positioning speed of motor 1")
    field.fill("1234")
    field.press("Enter")
    expect(page.locator("td.differs")).to_have_count(1)
    field.fill("5000")
    field.press("Enter")
    expect(field).to_have_class(re.compile("wrong"))
    field.press("Escape")
    expect(field).to_have_value("1234")
    page.get_by_label("changed only").check()
    expect(page.locator("table.parameters tbody tr")).to_have_count(1)
    with page.expect_download() as started:
        page.get_by_role("button", name="Export .toml").click()
    text = Path(started.value.path()).read_text()
    assert "[axis.1]\nmax_speed = 1234\n" in text
    page.locator("input[type=file]").set_input_files(
        {"name": "s.toml", "mimeType": "text/plain", "buffer": text.replace("1234", "888").encode()}
    )
    expect(field).to_have_value("888")


def test_every_other_parameter_view_opens(page: Page):
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("radio", name="Global").click()
    expect(page.locator("table.parameters")).to_contain_text("RS232/RS485 baud rate")
    page.get_by_role("radio", name="User variables").click()
    field = page.get_by_role("textbox", name="User variable 55")
    field.fill("-5")
    field.press("Enter")
    page.get_by_role("radio", name="Coordinates").click()
    place = page.get_by_role("textbox", name="Coordinate 20 of motor 2")
    place.fill("4711")
    place.press("Enter")
    page.get_by_role("radio", name="EEPROM").click()
    expect(page.locator(".eeprom")).to_contain_text("maximum positioning speed")
    page.get_by_role("radio", name="Coordinates").click()
    expect(place).to_have_value("4711")


# Plots and tools


def test_curves_are_drawn_chosen_and_exported(page: Page):
    page.keyboard.press("F9")
    _until(page, lambda: _figure(page, 0, "speed") == 500)
    canvas = page.locator(".plot canvas")
    expect(canvas).to_be_visible()
    page.get_by_role("button", name="load", exact=True).click()
    page.get_by_role("button", name="More curves").click()
    page.get_by_role("textbox", name="Search parameter").fill("general purpose variable #3")
    page.get_by_role("menuitem", name="add").first.click()
    expect(page.locator(".chip.watch")).to_contain_text("#3")
    page.wait_for_function(
        "() => document.querySelector('.plot canvas')?.getBoundingClientRect().width > 100"
    )
    box = canvas.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(page.locator(".readout")).to_contain_text("position 0")
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 80, box["y"] + box["height"] / 2)
    page.mouse.up()
    expect(page.locator(".plot .tool[title^='Show the newest']")).to_be_visible()
    for name, head in (
        ("CSV table", b"time_s,position_0"),
        ("VCD for", b"$timescale"),
        ("PNG picture", b"\x89PNG"),
    ):
        page.get_by_role("button", name="Export").hover()
        with page.expect_download() as started:
            page.get_by_role("menuitem", name=name).click()
        assert Path(started.value.path()).read_bytes().startswith(head)


def test_the_unit_calculator_goes_both_ways(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    velocity = page.get_by_role("textbox", name="Velocity")
    velocity.fill("2047")
    velocity.press("Enter")
    expect(page.locator(".tool-body")).to_contain_text("62\u2009469")
    speed = page.get_by_role("textbox", name="Turns a minute")
    speed.fill("60")
    speed.press("Enter")
    expect(velocity).to_have_value("419")
    expect(page.locator(".commands pre")).to_contain_text("SAP 4, 0, 419")


def test_the_reference_search_assistant_starts_and_aborts(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Reference search", exact=True).click()
    page.get_by_role("button", name="Start the search").click()
    expect(page.locator(".tool-body .pill").first).to_contain_text("searching")
    page.get_by_role("button", name="Abort the search").click()
    expect(page.locator(".tool-body .pill").first).to_have_text("idle")


def test_stall_tool_profile_configuration_and_firmware(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Stall detection").click()
    page.get_by_role("slider", name="Stall threshold").fill("3")
    expect(page.locator(".commands pre")).to_have_text("SAP 205, 0, 3")
    page.get_by_role("slider", name="Stall threshold").fill("0")
    page.get_by_role("button", name="Load profile").click()
    for name, value in (("From velocity", "100"), ("To velocity", "200"), ("Step", "100")):
        page.get_by_role("textbox", name=name).fill(value)
        page.keyboard.press("Enter")
    page.get_by_role("button", name="Measure").click()
    expect(page.locator(".profile-chart circle")).to_have_count(2)
    page.get_by_role("button", name="Module configuration").click()
    page.get_by_label("telegram pause time").fill("2")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Firmware and reset").click()
    expect(page.locator(".tool-body")).to_contain_text("343 V4.36")
    expect(page.get_by_role("button", name="Restore factory settings")).to_be_disabled()
    page.get_by_label("To be sure").fill("reset")
    page.get_by_role("button", name="Restore factory settings").click()
    expect(page.locator(".notice").last).to_contain_text("factory settings")


# The page itself


def test_themes_shortcuts_and_the_layout_are_remembered(page: Page):
    theme = page.locator("html").get_attribute("data-theme")
    page.keyboard.press("Alt+t")
    assert page.locator("html").get_attribute("data-theme") != theme
    page.keyboard.press("F1")
    expect(page.get_by_role("dialog", name="Keyboard shortcuts")).to_contain_text("STOP ALL")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    page.keyboard.press("Control+b")
    expect(page.locator(".files")).to_have_count(0)
    page.reload()
    expect(page.locator(".cm-content")).to_be_visible()
    expect(page.locator(".files")).to_have_count(0)
    assert page.locator("html").get_attribute("data-theme") != theme


def test_two_windows_see_the_same_module(page: Page, ide: Ide, chromium: Browser):
    context = chromium.new_context()
    other = context.new_page()
    other.goto(ide.url)
    expect(other.locator(".status-bar")).to_contain_text("2 windows")
    _tab(page, "Direct mode")
    _line(page, "ROR 1, 123")
    _until(other, lambda: _figure(other, 1, "speed") == 123)
    context.close()
    expect(page.locator(".status-bar")).not_to_contain_text("windows")


def test_a_lost_server_is_told_and_nothing_typed_is_lost(tmp_path: Path, chromium: Browser):
    (tmp_path / "program.tmc").write_text(PROGRAM)
    ide = Ide(tmp_path)
    context = chromium.new_context()
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".cm-content").press("Control+Home")
    ide.process.kill()
    expect(page.locator(".banner")).to_contain_text("does not answer")
    page.keyboard.type("// typed while away\n")
    port = re.search(r":(\d+)/", ide.url)
    assert port is not None
    again = Ide(ide.folder, "--listen", f"127.0.0.1:{port[1]}")
    try:
        expect(page.locator(".banner")).to_contain_text("started anew", timeout=20_000)
        page.goto(again.url)
        expect(page.locator(".cm-content")).to_contain_text("// typed while away")
    finally:
        context.close()
        again.stop()
        ide.stop()


def test_a_wrong_token_gets_a_clear_answer(page: Page, ide: Ide, chromium: Browser):
    context = chromium.new_context()
    stranger = context.new_page()
    stranger.goto(ide.url.split("?")[0] + "?token=wrong")
    expect(stranger.locator("h1")).to_have_text("Not this way")
    context.close()


def test_a_program_of_ten_thousand_lines_and_rubbish_are_borne(page: Page):
    page.locator(".cm-content").click()
    page.keyboard.press("Control+a")
    _paste(page, "WAIT TICKS, 0, 1 // nothing\n" * 10_000)
    expect(page.get_by_role("tab", name=re.compile("Problems"))).to_contain_text(re.compile(r"\d"))
    page.keyboard.press("Control+a")
    _paste(page, "\u0000\uffff\U0001f600 %%% ((( \\ MVP ,,,, ABS\n" * 50)
    expect(page.locator(".cm-lintRange-error").first).to_be_visible()
    page.keyboard.press("F9")
    expect(page.locator(".notice.error").first).to_be_visible()


def test_the_page_fits_a_tablet(page: Page):
    page.set_viewport_size({"width": 820, "height": 1180})
    expect(page.get_by_role("button", name="STOP ALL")).to_be_in_viewport()
    expect(page.locator(".axis.motor0")).to_be_in_viewport()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
