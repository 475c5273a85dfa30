"""The pytest plugin, in test folders of its own."""

import subprocess
import sys

import pytest

QUICKLY = [f"-pno:{name}" for name in ("cacheprovider", "hypothesispytest", "benchmark", "anyio", "asyncio")]
"""Plugins that take longer to load than the tests here to run."""
BENCH = "[[module]]\n[[module.axis]]\nload = { kind = 'carriage', start = 7.0 }\n"


@pytest.fixture
def run(pytester):
    """Call it with the text of a test file and options: the result of pytest."""

    def invoke(text, *options):
        pytester.makepyfile(test_it=text)
        return pytester.runpytest_subprocess(*QUICKLY, *options)

    return invoke


def test_each_test_has_a_fresh_module(run):
    result = run("""
        def test_one(tmcm343):
            tmcm343.motor(0).max_speed = 5
            assert tmcm343.model == 343

        def test_another(tmcm343, tmcm341, tmcm342):
            assert tmcm343.motor(0).max_speed != 5
            assert (tmcm341.model, tmcm342.model) == (341, 342)
    """)
    result.assert_outcomes(passed=2)


def test_the_configuration_chooses_bench_and_pace_for_all(run, pytester):
    pytester.makefile(".toml", machine=BENCH)
    pytester.makeini("[pytest]\ntmcm34x_bench = machine.toml\ntmcm34x_pace = 50\n")
    result = run("""
        import pytest

        def test_plain(tmcm34x):
            assert tmcm34x.speed == 50
            assert tmcm34x.motor(0).load_position == 7

        @pytest.mark.tmcm34x_pace("virtual")
        def test_other(tmcm34x):
            assert not tmcm34x.real_pace
    """)
    result.assert_outcomes(passed=2)


def test_markers_choose_model_bench_and_pace(run, pytester):
    pytester.makefile(".toml", machine=BENCH)
    result = run(
        """
        import pytest

        @pytest.mark.tmcm34x_model(341, 342)
        @pytest.mark.tmcm34x_bench("machine.toml")
        def test_models(tmcm34x):
            assert tmcm34x.model in {341, 342}
            assert tmcm34x.motor(0).load_position == 7

        @pytest.mark.tmcm34x_pace(20)
        def test_pace(tmcm34x):
            assert tmcm34x.real_pace
            tmcm34x.run(0.1)
            assert tmcm34x.now >= 0.1

        def test_plain(tmcm34x):
            assert tmcm34x.model == 343
        """,
        "--strict-markers",
        "-v",
    )
    result.assert_outcomes(passed=4)
    result.stdout.fnmatch_lines(["*test_models?341? PASSED*", "*test_models?342? PASSED*"])


def test_the_factory_makes_several_modules(run):
    result = run("""
        def test_two(tmcm34x_factory):
            first, second = tmcm34x_factory(341, seed=1), tmcm34x_factory(bench="[[module]]\\nmodel = 342\\n")
            assert (first.model, second.model) == (341, 342)
            assert first.port != second.port
    """)
    result.assert_outcomes(passed=1)


WRONG_MARKERS = (
    ("tmcm34x", "tmcm34x_model(344)", "the marker tmcm34x_model takes 341, 342 and 343, not (344,)"),
    ("tmcm34x", "tmcm34x_model()", "the marker tmcm34x_model takes 341, 342 and 343, not ()"),
    ("tmcm343", "tmcm34x_model(341)", "the marker tmcm34x_model is for tests with the fixture tmcm34x"),
    ("tmcm34x", "tmcm34x_bench()", "the marker tmcm34x_bench takes one argument"),
    ("tmcm34x", 'tmcm34x_bench("gone.toml")', "gone.toml: No such file or directory"),
    ("tmcm34x", 'tmcm34x_pace("fast")', "pace is 'virtual' or a factor of real time above 0, not 'fast'"),
)


def test_markers_that_are_wrong_say_so_in_a_line(pytester):
    for n, (fixture, marker, _) in enumerate(WRONG_MARKERS):
        text = f"import pytest\n\n@pytest.mark.{marker}\ndef test_it({fixture}):\n    pass\n"
        pytester.makepyfile(**{f"test_{n}": text})
    result = pytester.runpytest_subprocess(*QUICKLY, "--continue-on-collection-errors")
    result.assert_outcomes(errors=len(WRONG_MARKERS))
    lines = result.stdout.lines
    assert all(any(line.endswith(problem) for line in lines) for _, _, problem in WRONG_MARKERS)
    assert "pytest_plugin.py" not in result.stdout.str()


def test_a_mistake_is_shown_where_the_test_makes_it(run):
    result = run("""
        def test_late(tmcm343):
            tmcm343.until("GAP 8, 0 is 100 0", timeout=1)

        def test_side(tmcm343):
            tmcm343.press("lefft", 0)

        def test_in_a_condition(tmcm343):
            tmcm343.until(lambda: tmcm343.command("GAPP 1, 0"))

        def test_over_a_thread(tmcm343):
            assert tmcm343.port
            tmcm343.motor(0).max_speed = 5000

        def test_bench(tmcm34x_factory):
            tmcm34x_factory(bench="gone.toml")
    """)
    result.assert_outcomes(failed=5)
    result.stdout.fnmatch_lines(
        [
            "tmcm343 = <TMCM-343>",
            ">*tmcm343.until(*",
            "E*GAP 8, 0 is 100 0 did not come true within 1 s; it is 100 1 now",
            ">*tmcm343.press(*",
            "E*switch: side is left or right, not 'lefft'",
            ">*lambda: tmcm343.command(*",
            "E*unknown command GAPP*",
            ">*max_speed = 5000",
            "E*max_speed of motor 0: invalid value",
            ">*tmcm34x_factory(*",
            "E*gone.toml: No such file or directory",
        ]
    )
    result.stdout.no_fnmatch_line("*src?tmcm34x*")


def test_a_failed_test_shows_what_happened(run, pytester):
    result = run(
        """
        def test_it(tmcm343):
            host = tmcm343.connect()
            host.axes[1].move_to(3000)
            tmcm343.run(2)
            assert tmcm343.motor(1).position == 0
        """,
        "--tmcm34x-plots",
        "plots",
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*TMCM-343*",
            "telegrams",
            "*> *MVP ABS, 1, 3000",
            "*motor 1: position 3000, target 3000, speed 0",
            "motor 1 *0..3000",
            "*test_it.py-test_it.svg",
        ]
    )
    (plot,) = (pytester.path / "plots").iterdir()
    assert plot.read_text().startswith("<svg")


def test_a_test_without_a_module_imports_nothing_of_it(pytester):
    pytester.makepyfile(
        test_it="""
        import sys

        def test_it():
            loaded = {name for name in sys.modules if name.startswith("tmcm34x")}
            assert loaded <= {"tmcm34x", "tmcm34x.pytest_plugin"}
            assert "serial" not in sys.modules
        """
    )
    pytester.runpytest_subprocess(*QUICKLY).assert_outcomes(passed=1)


def test_it_works_under_xdist(run):
    result = run(
        """
        import pytest
        import serial

        @pytest.mark.parametrize("n", range(6))
        def test_it(tmcm343, n):
            with serial.Serial(tmcm343.port, timeout=5) as port:
                port.write(bytes.fromhex("01 06 04 00 00 00 00 00 0b"))
                assert len(port.read(9)) == 9
        """,
        "-n",
        "2",
    )
    result.assert_outcomes(passed=6)


def test_it_works_under_pytest_asyncio(pytester):
    pytest.importorskip("pytest_asyncio", reason="it is in the group dev: make .venv/.test")
    pytester.makepyfile(
        test_it="""
        import asyncio

        import pytest

        from tmcm34x.host import AsyncConnection
        from tmcm34x.host.settings import identify

        @pytest.mark.asyncio
        async def test_streams(tmcm343):
            reader, writer = await asyncio.open_connection(*tmcm343.address.split(":"))
            writer.write(bytes.fromhex("01 06 04 00 00 00 00 00 0b"))
            assert len(await asyncio.wait_for(reader.readexactly(9), 5)) == 9
            writer.close()
            await writer.wait_closed()

        @pytest.mark.asyncio
        async def test_the_library_in_two_tasks(tmcm343, tmcm341):
            async def ask(module):
                async with await AsyncConnection.open(f"tcp:{module.address}") as connection:
                    return await connection.run(identify())

            models = [model for model, _ in await asyncio.gather(ask(tmcm343), ask(tmcm341))]
            assert models == [343, 341]

        @pytest.mark.asyncio
        async def test_time_is_moved_by_the_test(tmcm343):
            tmcm343.command("MVP ABS, 0, 500")
            tmcm343.until("motor 0 at 500")
        """
    )
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    quickly = [option for option in QUICKLY if "asyncio" not in option]
    pytester.runpytest_subprocess(*quickly).assert_outcomes(passed=3)


# Coverage of TMCL programs

PROGRAM = """
        GGP   0, 2
        JC    ZE, Zero
        SIO   1, 2, 1
        STOP
Zero:   SIO   0, 2, 1
        STOP
"""
COVERED = """
    from pathlib import Path
    import pytest

    @pytest.mark.parametrize("value", [0, 0, 1], ids=["zero", "again", "other"])
    def test_it(tmcm343, value):
        tmcm343.command(f"SGP 0, 2, {value}")
        tmcm343.load(Path("demo.tmc"), run=True)
        tmcm343.run(0.1)
        assert tmcm343.command(f"GIO {value}, 2") == (100, 1)
"""
ALL_TESTS = """\
TN:
SF:demo.tmc
BRDA:3,0,0,2
BRDA:3,0,1,1
BRF:2
BRH:2
DA:2,3
DA:3,3
DA:4,1
DA:5,1
DA:6,2
DA:7,2
LF:6
LH:6
end_of_record
"""


@pytest.fixture
def demo(pytester):
    """The program file that the tests load."""
    path = pytester.path / "demo.tmc"
    path.write_text(PROGRAM)
    return path


@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_coverage_is_summed_over_tests_and_workers(run, pytester, demo, workers):
    result = run(COVERED, "--tmcl-coverage=cover", *workers)
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(
        ["demo.tmc     6 of     6 commands,    2 of    2 branches", "written: *.info*"]
    )
    assert (pytester.path / "cover" / "coverage.info").read_text() == ALL_TESTS
    assert "6 of 6 commands executed" in (pytester.path / "cover" / "coverage.html").read_text()


def test_coverage_adds_to_earlier_runs_where_wanted(run, pytester, demo):
    tracefile = pytester.path / "tmcl-coverage" / "coverage.info"
    for options, counted in (((), "DA:2,1\n"), ((), "DA:2,1\n"), (("--tmcl-coverage-append",), "DA:2,2\n")):
        run(COVERED, "-k", "other", "--tmcl-coverage", *options)
        assert counted in tracefile.read_text()


def test_a_program_that_the_host_downloads_is_covered(run, pytester, demo):
    result = run(
        """
        from pathlib import Path
        from tmcm34x.host import program
        from tmcm34x.toolchain.assembler import assemble

        def test_download(tmcm343):
            tmcm343.covers(Path("demo.tmc"))
            connection = tmcm343.connect().connection
            connection.run(program.download(assemble(Path("demo.tmc").read_text()).program))
            connection.run(program.run())
            tmcm343.until("output 0 high")

        def test_another_program(tmcm343):
            tmcm343.covers(Path("demo.tmc"))
            tmcm343.run(1)
        """,
        "--tmcl-coverage",
    )
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(
        ["demo.tmc     4 of     6 commands,    1 of    2 branches", "demo.tmc: not counted *"]
    )


def test_run_program_is_covered(run, demo):
    result = run(
        """
        from pathlib import Path
        from tmcm34x.testing.programs import run_program

        def test_it():
            assert not run_program(Path("demo.tmc")).refusals
            run_program("STOP")
        """,
        "--tmcl-coverage",
    )
    result.stdout.fnmatch_lines(["demo.tmc     4 of     6 commands,    1 of    2 branches"])


def test_coverage_of_nothing_says_so(run):
    run("", "--tmcl-coverage").stdout.fnmatch_lines(["no program from a file was loaded"])


def test_coverage_that_cannot_be_written_is_a_usage_error(run, pytester, demo):
    for options, problem in (
        (["--tmcl-coverage=demo.tmc"], "File exists"),
        (["--tmcl-coverage-append"], "--tmcl-coverage-append needs --tmcl-coverage too"),
        (["--tmcl-coverage=.", "--tmcl-coverage-append"], "line 1 is not of an lcov tracefile"),
    ):
        (pytester.path / "coverage.info").write_text("hello")
        result = run("", *options)
        assert result.ret == 4
        assert problem in result.stderr.str()


# Sessions


def test_session_files_are_tests(run, pytester):
    pytester.makefile(".session", good="== reads\n# links: serial\n> GAP 4, 0\n< 100 1000\n")
    pytester.makefile(".session", bad="# models: 343\n== wrong\n# links: can\n> GAP 4, 0\n< 100 7\n")
    result = run("")
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines(
        ["*wrong?343-can?*", "*bad.session:5: < 100 7", "*expected*value 7", "*got*value 1000*"]
    )


def test_a_session_file_that_cannot_be_read_is_an_error(run, pytester):
    pytester.makefile(".session", bad="== wrong\n> FOO\n")
    result = run("")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*bad.session:2:3: unknown command FOO*"])


# Real hardware, as which a served module serves


TESTS = """
    import serial

    def test_reads(tmcm343):
        with serial.Serial(tmcm343.port, timeout=5) as port:
            port.write(bytes.fromhex("01 06 04 00 00 00 00 00 0b"))
            assert len(port.read(9)) == 9
        tmcm343.motor(0).max_speed = 900
        assert tmcm343.motor(0).max_speed == 900
        assert tmcm343.command("MVP ABS, 0, 1000") == (100, 1000)
        assert tmcm343.until("GAP 8, 0 is 100 1", timeout=5) > 0
        assert tmcm343.motor(0).position == 1000

    def test_runs_a_program(tmcm343):
        tmcm343.load("again: \\n ROR 0, 100 \\n JA again", run=True)
        tmcm343.until(lambda: tmcm343.motor(0).moving)
        with tmcm343.connect() as module, serial.serial_for_url(tmcm343.serial_url, timeout=5):
            assert module.model == 343

    def test_program_and_motors_stand_still_after_it(tmcm343):
        assert tmcm343.command("GGP 128, 0") == (100, 0)
        assert not tmcm343.motor(0).moving
        assert False, "and this is shown"

    def test_needs_a_bench(tmcm343):
        tmcm343.press("left", 0)

    def test_another_model(tmcm341):
        pass
"""


def test_the_same_tests_run_on_a_port(serve, run, pytester):
    pytester.makefile(".session", good="# models: 343\n== reads\n# links: serial\n> GAP 4, 1\n< 100 1000\n")
    served = serve("--pty", "--speed", "10")
    result = run(TESTS, f"--tmcm34x-port={served.pty}", "-rs")
    result.assert_outcomes(passed=3, failed=1, skipped=2)
    result.stdout.fnmatch_lines(
        [
            "*and this is shown*",
            "TMCM-343 at *, program stopped",
            "  motor 0: position *, target *, speed 0",
            "*'switch' of a bench is not available on a real module",
            "*is a TMCM-343",
        ]
    )


ON_CAN = """
    import can

    def test_a_driver(tmcm343):
        with can.Bus(**tmcm343.can) as bus:
            bus.send(can.Message(arbitration_id=1, data=[6, 4, 0, 0, 0, 0, 0], is_extended_id=False))
            assert bus.recv(5).data == bytes([1, 100, 6, 0, 0, 3, 232])
        tmcm343.command("MVP ABS, 1, 500")
        tmcm343.until("GAP 8, 1 is 100 1")

    def test_needs_a_serial_port(tmcm343):
        tmcm343.port
"""


def test_the_same_tests_run_on_a_can_bus(serve, run, pytester):
    pytester.makefile(
        ".session",
        frames="# models: 343\n== frames\n# links: can\n> id 1: 06 04 00 00 00 00 00\n< 100 1000\n"
        "== bytes\n# links: serial\n> GAP 4, 1\n< 100 1000\n",
    )
    port = f"slcan:{serve('--slcan', '--speed', '10').links[0][1]}"
    result = run(ON_CAN, f"--tmcm34x-port={port}", "-rs")
    result.assert_outcomes(passed=2, skipped=2)
    result.stdout.fnmatch_lines(["*needs a serial line", "*is no serial port"])


def test_a_port_without_a_module_ends_the_run(run):
    result = run(TESTS, "--tmcm34x-port=/dev/nothing")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "--tmcm34x-port: cannot open /dev/nothing" in result.stdout.str() + result.stderr.str()


# unittest


def test_plain_unittest_has_the_context_manager(pytester):
    path = pytester.makepyfile(
        test_unit="""
        import unittest

        from tmcm34x.testing import VirtualModule

        class Test(unittest.TestCase):
            def setUp(self):
                self.module = self.enterContext(VirtualModule(343))

            def test_it(self):
                self.module.command("MVP ABS, 0, 500")
                self.module.until("motor 0 at 500")

        if __name__ == "__main__":
            unittest.main()
        """
    )
    result = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, check=False)
    assert (result.returncode, "OK" in result.stderr) == (0, True)
