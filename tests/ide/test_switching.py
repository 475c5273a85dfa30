"""From one module to another while the server runs."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from ide.ide_driver import running
from ide.served import Bench
from tmcm34x.ide import wire
from tmcm34x.ide.modules import plain
from tmcm34x.ide.telegrams import Telegrams
from tmcm34x.links.can import CanBusLink
from tmcm34x.links.posix.slcan import SlcanLink

STEPS = "SGP 5, 2, 7\nCSUB Sub\nSTOP\nSub: SGP 6, 2, 8\nRSUB\n"
BENCH = """\
[[module]]
model = 341

[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0, low = -2.0, high = 202.0, start = 60.0 }
"""


def _go(folder, scenario, *benches):
    """Run a scenario with an IDE on a virtual module, and served modules beside it."""

    async def run():
        async with running(folder) as ide, ide.page() as page:
            await scenario(ide, page, *benches)

    try:
        asyncio.run(run())
    finally:
        for bench in benches:
            bench.stop()


def _url(bench, **options):
    query = "&".join(f"{name}={value}" for name, value in options.items())
    return f"tcp:{bench.address}" + (f"?{query}" if query else "")


def _remembered(bench):
    """What a command could have changed."""
    module = bench.module
    return module.eeprom.to_bytes(), [dict(axis.values) for axis in module.axes], module.program.state


async def _welcome(page, test=lambda event: True):
    return await page.event(wire.Welcome, test)


def test_the_ide_goes_to_a_real_module_and_back_with_all_windows(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(ide, page, bench):
        async with ide.page() as other:
            await page.execute("SGP 5, 2, 99")
            await page.call(wire.Connect(_url(bench)))
            for window in (page, other):
                welcome = await _welcome(window)
                assert (welcome.source, welcome.model.number, welcome.seat) == ("tcp", 341, 2)
                assert welcome.url.startswith(_url(bench))
                assert (await window.event(wire.Authority, lambda event: event.real)).armed is False
            assert await page.refusal(wire.ExecuteText("ROR 0, 100")) == "disarmed"
            assert await page.refusal(wire.SetTime(True)) == "real"
            await page.execute("SGP 5, 2, 7")
            assert bench.module.eeprom.variables[5] == 0
            assert (await other.execute("GGP 5, 2"))["value"] == 7
            await page.call(wire.UseVirtual())
            assert (await _welcome(other)).source == "virtual"
            await page.execute("ROR 0, 100")
            await page.until(lambda: page.state["motor0"]["speed"] == 100)
        assert bench.speed(0) == 0

    _go(tmp_path, scenario, Bench(341))


def test_what_was_started_on_a_module_is_stopped_before_it_is_left(tmp_path):
    async def scenario(ide, page, bench, other):
        await page.call(wire.Connect(_url(bench)))
        await page.call(wire.Arm(True))
        await page.execute("ROR 0, 400")
        await page.until(lambda: bench.speed(0) == 400)
        await page.call(wire.Connect(_url(other)))
        assert bench.speed(0) == 0
        assert not ide.hub.authority.armed
        assert (await _welcome(page, lambda event: event.model.number == 341)).source == "tcp"

    _go(tmp_path, scenario, Bench(343), Bench(341))


def test_a_module_that_cannot_be_brought_to_rest_is_named_when_it_is_left(tmp_path, monkeypatch):
    monkeypatch.setattr("tmcm34x.ide.authority.CLOSE_S", 0.5)

    async def scenario(ide, page, bench):
        await page.call(wire.Connect(_url(bench)))
        await page.call(wire.Arm(True))
        await page.execute("ROR 1, 400")
        bench.arm("silent")
        await page.call(wire.UseVirtual())
        told = await page.event(wire.Output, lambda event: "was left" in event.text)
        assert "motor 1" in told.text
        assert bench.address in told.text

    _go(tmp_path, scenario, Bench())


def test_a_wrong_address_and_a_dead_port_are_told_in_one_line_and_leave_the_module_as_it_is(tmp_path):
    async def scenario(ide, page, bench):
        answer = await page.ask(wire.Connect(_url(bench, address=9)))
        assert (answer.code, answer.text.count("\n")) == ("silent", 0)
        assert "address 9" in answer.text
        assert "check power, wiring, address" in answer.text
        await asyncio.to_thread(bench.stop)
        answer = await page.ask(wire.Connect(_url(bench)))
        assert answer.code == "line"
        assert bench.address in answer.text
        for wrong in ("", "tcp:nowhere", "tcp:h:1?speed=3", "can:x"):
            assert await page.refusal(wire.Connect(wrong)) == "url"
        assert ide.hub.target.source == "virtual"
        assert (await page.execute("GAP 4, 0"))["value"] == 1000

    _go(tmp_path, scenario, Bench())


def test_a_silent_module_is_waited_for_when_that_is_wanted_and_nothing_of_it_is_known(tmp_path):
    async def scenario(ide, page, bench):
        await page.call(wire.Connect(_url(bench, address=9), anyway=True))
        welcome = await _welcome(page)
        assert not welcome.model.known
        assert "address 9" in (await page.event(wire.Link, lambda event: not event.up)).text
        await page.until(lambda: page.state["quality"]["seen"] == 0)
        assert page.state["quality"]["motor0"] & 1
        bench.module.axes[0]  # the module is there, at address 1
        assert await page.refusal(wire.Arm(True)) == "silent"

    _go(tmp_path, scenario, Bench())


def test_the_same_line_is_opened_anew_with_another_address_and_given_back_where_that_is_silent(tmp_path):
    async def scenario(ide, page, bench):
        await page.call(wire.Connect(_url(bench)))
        assert await page.refusal(wire.Connect(_url(bench, address=3))) == "silent"
        await page.until(lambda: ide.hub.target.link.up)
        assert "address 1" in ide.hub.target.place
        await page.call(wire.ExecuteText("SGP 66, 0, 3", sure=True))
        await page.call(wire.Connect(_url(bench, address=3)))
        assert (await page.execute("GGP 66, 0"))["value"] == 3

    _go(tmp_path, scenario, Bench())


def test_breakpoints_go_along_and_say_that_a_real_module_has_none(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(ide, page, bench):
        async with ide.debugger() as editor:
            await page.call(wire.Download("a.tmc"))
            (placed,) = await editor.breakpoints("a.tmc", {"line": 3})
            assert placed["verified"]
            await page.call(wire.Connect(_url(bench)))
            moved = await editor.event("tmcl_breakpoints")
            assert not moved["placed"][0]["verified"]
            await page.call(wire.Arm(True))
            await page.call(wire.Download("a.tmc"))
            await editor.do("stepIn", threadId=1)
            await editor.event("stopped")
            await page.call(wire.UseVirtual())
            assert (await editor.event("tmcl_breakpoints"))["breakpoints"] == [{"line": 3}]

    _go(tmp_path, scenario, Bench())


def test_a_bench_from_a_page_or_the_folder_is_rebuilt_around_the_module(tmp_path):
    (tmp_path / "stage.toml").write_text(BENCH)

    async def scenario(ide, page):
        await page.call(wire.UseVirtual(bench="stage.toml"))
        welcome = await _welcome(page)
        assert (welcome.module, welcome.model.number) == ("stage.toml", 341)
        assert (await page.call(wire.ReadWorld()))["axes"][0]["high"] == 202.0
        await page.execute("SGP 5, 2, 7")
        await page.execute("STGP 5, 2")
        await page.call(wire.UseVirtual(bench="stage.toml", text=BENCH.replace("202.0", "302.0")))
        assert (await page.call(wire.ReadWorld()))["axes"][0]["high"] == 302.0
        await page.execute("RSGP 5, 2")
        assert (await page.execute("GGP 5, 2"))["value"] == 7
        await page.call(wire.UseVirtual(bench="stage.toml", keep=False))
        await page.execute("RSGP 5, 2")
        assert (await page.execute("GGP 5, 2"))["value"] == 0
        answer = await page.ask(wire.UseVirtual(bench="x.toml", text="[[module]]\nmodel = 999\n"))
        assert (answer.code, "module[0].model" in answer.text) == ("bench", True)
        assert (await page.call(wire.ReadWorld()))["bench"] == "stage.toml"
        await page.call(wire.UseVirtual(model=342))
        assert (await _welcome(page, lambda event: event.model.number == 342)).module == "bare motors"

    _go(tmp_path, scenario)


def test_a_download_is_not_cut_off_by_another_module(tmp_path):
    (tmp_path / "a.tmc").write_text("WAIT TICKS, 0, 1\n" * 1500 + "STOP\n")

    async def scenario(ide, page, bench):
        await page.call(wire.Connect(_url(bench)))
        download = asyncio.create_task(page.call(wire.Download("a.tmc")))
        await page.event(wire.Progress, lambda event: event.done > 0)
        assert await page.refusal(wire.UseVirtual()) == "busy"
        assert await page.refusal(wire.Connect("tcp:127.0.0.1:1")) == "busy"
        assert (await download)["listing"]

    _go(tmp_path, scenario, Bench())


@pytest.mark.parametrize(
    "url",
    ["/etc/passwd", "spy:///dev/null", "serial:/dev/watchdog", "slcan:/etc/passwd", "can:slcan:/dev/null",
     "virtual:343?bench=/etc/passwd", "loop://"],
)  # fmt: skip
def test_a_page_opens_serial_ports_and_nothing_else_that_has_a_name(tmp_path, url):
    async def scenario(ide, page):
        assert await page.refusal(wire.Connect(url, anyway=True)) == "port"
        assert await page.refusal(wire.Scan([url])) == "port"

    _go(tmp_path, scenario)


def test_pages_of_a_server_that_others_can_reach_open_no_lines(tmp_path):
    async def scenario(ide, page, bench):
        ide.hub.switching._modules.local = False
        assert await page.refusal(wire.Connect(_url(bench))) == "port"
        ports = await page.call(wire.ListPorts())
        assert (ports["serial"], "--port" in ports["closed"]) == ([], True)
        await page.call(wire.UseVirtual(model=342))

    _go(tmp_path, scenario, Bench())


def test_a_scan_finds_modules_can_be_stopped_and_changes_nothing(tmp_path):
    async def scenario(ide, page, bench, other):
        before = _remembered(bench)
        await page.call(wire.Scan([_url(bench), _url(other)]))
        found = await page.event(wire.ScanFound)
        assert (found.model, found.version, "address 1" in found.place) == (341, "V4.36", True)
        assert (await page.event(wire.ScanFound)).model == 342
        assert (await page.event(wire.ScanEnded)).complete
        assert _remembered(bench) == before
        await page.call(wire.Scan([_url(bench)], far=True))
        assert await page.refusal(wire.Scan([_url(other)])) == "busy"
        await page.event(wire.ScanProgress)
        await page.call(wire.StopScan())
        assert not (await page.event(wire.ScanEnded)).complete
        await asyncio.to_thread(other.stop)
        await page.call(wire.Scan([_url(other)]))
        assert other.address in (await page.event(wire.ScanFailed)).text

    _go(tmp_path, scenario, Bench(341), Bench(342))


def test_a_scan_ends_with_its_window_and_leaves_the_line_in_use_alone(tmp_path):
    async def scenario(ide, page, bench):
        async with ide.page() as other:
            await other.call(wire.Scan([_url(bench)], far=True))
            await other.event(wire.ScanProgress)
        await page.until(ide.hub.switching.scanning._task.done)
        await page.call(wire.Connect(_url(bench)))
        await page.call(wire.Scan([_url(bench)]))
        assert (await page.event(wire.ScanEnded)).complete
        assert not [event for event in page.events if isinstance(event, wire.ScanFound)]

    _go(tmp_path, scenario, Bench())


def _bus(channel):
    return lambda server: server.open_can(CanBusLink("virtual", channel, 1_000_000))


def _slcan(server):
    return server.open_can(SlcanLink(None, lambda: 0))


@pytest.mark.parametrize("kind", ["can", "slcan"])
def test_a_module_on_can_is_a_real_one_like_any_other(tmp_path, kind, request):
    pytest.importorskip("can", reason="python-can is the extra `can`")
    (tmp_path / "a.tmc").write_text(STEPS)
    bench = Bench(link=_bus(request.node.name) if kind == "can" else _slcan)
    target = f"can:virtual:{request.node.name}" if kind == "can" else f"slcan:{bench.address}"

    async def scenario(ide, page, bench):
        answer = await page.ask(wire.Connect(f"{target}?id=9&reply=2"))
        assert (answer.code, "identifiers" in answer.text) == ("silent", True)
        await page.call(wire.Connect(f"{target}?id=1&reply=2"))
        welcome = await _welcome(page)
        assert (welcome.source, welcome.model.known) == (kind, True)
        assert "1000 kbit/s, id 1, replies 2" in welcome.module
        await page.call(wire.Arm(True))
        answer = await page.call(wire.Download("a.tmc"))
        text = await page.call(wire.Upload())
        again = await page.call(wire.Assemble("b.tmc", {"b.tmc": text}))
        assert again["listing"]["identity"] == answer["listing"]["identity"]
        await page.execute("ROR 0, 300")
        await page.until(lambda: page.state["motor0"]["speed"] == 300)
        await page.call(wire.StopAll())
        await page.until(lambda: bench.speed(0) == 0)
        await page.call(wire.ExecuteText("SGP 71, 0, 5", sure=True))
        assert "id 5" in (await page.event(wire.Link, lambda event: "id 5" in event.place)).place
        assert (await page.execute("GGP 71, 0"))["value"] == 5

    _go(tmp_path, scenario, bench)


def test_lines_of_other_hosts_are_opened_again_on_the_next_virtual_module(tmp_path):
    async def run():
        from ide.ide_driver import virtual

        target, telegrams = virtual()
        modules = plain(telegrams)

        async def links(module):
            from tmcm34x.links.tcp import TcpLink

            return [f"tcp {await module.server.open(TcpLink('127.0.0.1', 0))}"]

        modules.open_links = links
        async with running(tmp_path, (target, telegrams), modules=modules) as ide, ide.page() as page:
            await page.call(wire.UseVirtual(model=341))
            welcome = await _welcome(page)
            (line,) = welcome.links
            host, _, port = line.removeprefix("tcp ").rpartition(":")
            reader, writer = await asyncio.open_connection(host, int(port))
            writer.write(bytes((1, 136, 0, 0, 0, 0, 0, 0, 137)))
            assert (await reader.readexactly(9))[1:] == b"341V4.36"
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()

    asyncio.run(run())


def test_telegrams_of_the_new_module_go_into_the_same_log(tmp_path):
    assert Telegrams().since(0) is None

    async def scenario(ide, page, bench):
        await page.call(wire.FollowLog(True))
        await page.call(wire.Connect(_url(bench)))
        await page.execute("GAP 4, 0")
        await page.event(wire.Telegrams, lambda event: any("GAP 4, 0" in line.text for line in event.lines))

    _go(tmp_path, scenario, Bench())
