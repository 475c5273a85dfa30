"""The pytest plugin: modules as fixtures, sessions as tests (docs/testing.md).

pytest imports this file in every run in which the package is installed, so all else is imported when it is used.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import pytest

if TYPE_CHECKING:
    from tmcm34x.bench.session.language import Case
    from tmcm34x.testing import ModuleUnderTest

MODELS = (341, 342, 343)
SUFFIX = ".session"
Factory = Callable[..., "ModuleUnderTest"]
_MODULES: pytest.StashKey[list[Any]] = pytest.StashKey()
_COVERAGE: pytest.StashKey[Any] = pytest.StashKey()
_SAVED = "tmcl_coverage"
_NONE: list[Any] = []
_SETTINGS = "bench", "pace"
_NUMBER = re.compile(r"-?\d+(\.\d*)?")
_UNSAFE = re.compile(r"[^\w.-]+")
_MARKERS = (
    "tmcm34x_model(341, 342, 343): module types on which a test with the fixture `tmcm34x` runs",
    "tmcm34x_bench(path): bench file of the test's modules, beside the test file or in the root folder",
    "tmcm34x_pace(pace): 'virtual' (default), or a factor of real time",
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options of the command line."""
    group = parser.getgroup("tmcm34x", "modules TMCM-341, 342 and 343")
    group.addoption(
        "--tmcm34x-port",
        metavar="PORT",
        help="run the tests on the real module there: a serial port, tcp://HOST:PORT, "
        "can:INTERFACE:CHANNEL?id=1&reply=2 or slcan:DEVICE",
    )
    group.addoption(
        "--tmcm34x-baud", type=int, default=9600, metavar="RATE", help="bits per second of the port"
    )
    group.addoption("--tmcm34x-address", type=int, default=1, metavar="N", help="address of the real module")
    group.addoption(
        "--tmcm34x-plots", metavar="FOLDER", help="draw what the motors did in failed tests as SVG files"
    )
    group.addoption(
        "--tmcl-coverage",
        nargs="?",
        const="tmcl-coverage",
        metavar="FOLDER",
        help="write which lines of TMCL programs were executed, as coverage.info (lcov) and coverage.html",
    )
    group.addoption(
        "--tmcl-coverage-append", action="store_true", help="add to what the folder holds from earlier runs"
    )
    parser.addini("tmcm34x_bench", "bench file of all modules without the marker, from the root folder")
    parser.addini("tmcm34x_pace", "'virtual' or a factor of real time, of all modules without the marker")


def pytest_configure(config: pytest.Config) -> None:
    """Markers."""
    for marker in _MARKERS:
        config.addinivalue_line("markers", marker)
    if config.option.tmcl_coverage:
        _collect_coverage(config)
    elif config.option.tmcl_coverage_append:
        raise pytest.UsageError("--tmcl-coverage-append needs --tmcl-coverage too")


# Fixtures


@pytest.fixture
def tmcm34x_factory(request: pytest.FixtureRequest) -> Iterator[Factory]:
    """Call it for modules: `tmcm34x_factory(343, bench="machine.toml", pace=10, seed=1)`, see `VirtualModule`.

    With --tmcm34x-port it can be called once, and gives the real module.
    """
    made: list[Any] = []
    request.node.stash[_MODULES] = made

    def make(model: int | None = None, **options: Any) -> ModuleUnderTest:
        module = (
            _real(request.config, model, made)
            if request.config.option.tmcm34x_port
            else _virtual(request, model, options)
        )
        made.append(module)
        return module

    yield make
    _close(made)


def _close(made: list[Any]) -> None:
    errors: list[Exception] = []
    for module in made:
        try:
            module.close()
        except Exception as error:  # all must be closed; the first error is raised below
            errors.append(error)
    if errors:
        raise errors[0]


def _real(config: pytest.Config, model: int | None, made: list[Any]) -> ModuleUnderTest:
    from tmcm34x.testing.real import reach

    option = config.option
    if made:
        pytest.skip("there is one real module only")
    module = reach(option.tmcm34x_port, option.tmcm34x_baud, option.tmcm34x_address)
    if isinstance(module, str):
        pytest.exit(f"--tmcm34x-port: {module}", returncode=pytest.ExitCode.USAGE_ERROR)
    if model not in {None, module.model}:
        pytest.skip(f"the module at {option.tmcm34x_port} is a TMCM-{module.model}")
    return module


def _virtual(request: pytest.FixtureRequest, model: int | None, options: dict[str, Any]) -> ModuleUnderTest:
    from tmcm34x.testing.virtual import VirtualModule

    options = {**_marked(request), **options}
    if isinstance(options.get("bench"), str | Path):
        options["bench"] = _find(request, options["bench"])
    return VirtualModule(model, **options)


def _marked(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What the markers of a test say, or else the configuration."""
    found = {name: _configured(request.config, name) for name in _SETTINGS}
    for name in _SETTINGS:
        marker = request.node.get_closest_marker(f"tmcm34x_{name}")
        if marker is not None:
            if len(marker.args) != 1:
                pytest.fail(f"the marker tmcm34x_{name} takes one argument", pytrace=False)
            found[name] = marker.args[0]
    return {name: value for name, value in found.items() if value is not None}


def _configured(config: pytest.Config, name: str) -> str | Path | float | None:
    """What the configuration file says for all modules; a pace that is no number is left for the module to refuse."""
    text = str(config.getini(f"tmcm34x_{name}"))
    if not text:
        return None
    if name == "bench":
        return config.rootpath / text
    return float(text) if _NUMBER.fullmatch(text) else text


def _find(request: pytest.FixtureRequest, bench: str | Path) -> str | Path:
    """A bench file beside the test file, or in the root folder; text stays as it is."""
    if isinstance(bench, str) and "\n" in bench:
        return bench
    for folder in (request.path.parent, request.config.rootpath):
        if (folder / bench).is_file():
            return folder / bench
    return Path(bench)


@pytest.fixture
def tmcm341(tmcm34x_factory: Factory) -> ModuleUnderTest:
    """A fresh TMCM-341."""
    return tmcm34x_factory(341)


@pytest.fixture
def tmcm342(tmcm34x_factory: Factory) -> ModuleUnderTest:
    """A fresh TMCM-342."""
    return tmcm34x_factory(342)


@pytest.fixture
def tmcm343(tmcm34x_factory: Factory) -> ModuleUnderTest:
    """A fresh TMCM-343."""
    return tmcm34x_factory(343)


@pytest.fixture
def tmcm34x(request: pytest.FixtureRequest, tmcm34x_factory: Factory) -> ModuleUnderTest:
    """A fresh module of each type that the marker `tmcm34x_model` names; the bench's, else a TMCM-343, without it."""
    return tmcm34x_factory(getattr(request, "param", None))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test with the fixture `tmcm34x` on each type that its marker names."""
    marker = metafunc.definition.get_closest_marker("tmcm34x_model")
    if marker is None:
        return
    if "tmcm34x" not in metafunc.fixturenames:
        if marker in metafunc.definition.own_markers:
            pytest.fail("the marker tmcm34x_model is for tests with the fixture tmcm34x", pytrace=False)
        return
    if not marker.args or set(marker.args) - set(MODELS):
        pytest.fail(f"the marker tmcm34x_model takes 341, 342 and 343, not {marker.args}", pytrace=False)
    metafunc.parametrize("tmcm34x", marker.args, indirect=True)


# Reports


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show what happened on the modules of a failed test; skip what no real module can do."""
    plain = call.excinfo is not None and _is_ours(call.excinfo) and not _end_at_test(item, call.excinfo)
    outcome = yield
    if plain and outcome.failed:
        outcome.longrepr = cast("pytest.ExceptionInfo[BaseException]", call.excinfo).exconly()
    if call.excinfo is not None and _needs_bench(call.excinfo):
        outcome.outcome = "skipped"
        outcome.longrepr = (str(item.path), item.location[1] or 0, f"Skipped: {call.excinfo.value}")
    elif outcome.when == "call" and outcome.failed:
        for module in item.stash.get(_MODULES, _NONE):
            _add_report(item, outcome, module)
    return outcome


def _is_ours(excinfo: pytest.ExceptionInfo[BaseException]) -> bool:
    """Whether this package has raised it on purpose."""
    return type(excinfo.value).__module__.startswith("tmcm34x.")


def _end_at_test(item: pytest.Item, excinfo: pytest.ExceptionInfo[BaseException]) -> bool:
    from tmcm34x.testing.traceback import end_at_caller

    shown_otherwise = item.config.option.fulltrace or not isinstance(item, pytest.Function)
    return shown_otherwise or end_at_caller(excinfo.value, item.config.rootpath)


def _needs_bench(excinfo: pytest.ExceptionInfo[BaseException]) -> bool:
    """Recognised by name, so that nothing is imported for tests that have nothing to do with modules."""
    return type(excinfo.value).__name__ == "NotOnRealModuleError"


def _add_report(item: pytest.Item, outcome: pytest.TestReport, module: Any) -> None:
    from tmcm34x.testing.report import real_report, report, save_picture

    if module.real:
        outcome.sections.append(("state", real_report(module)))
        return
    outcome.sections.append((f"TMCM-{module.model}", report(module)))
    folder = item.config.option.tmcm34x_plots
    if folder:
        path = Path(folder) / f"{_UNSAFE.sub('-', item.nodeid)}.svg"
        path.parent.mkdir(parents=True, exist_ok=True)
        save_picture(module, path, item.name)
        outcome.sections.append(("plot", str(path)))


# Coverage of TMCL programs


def _collect_coverage(config: pytest.Config) -> None:
    from tmcm34x.testing import coverage

    coverage.collector = collector = coverage.Collector(config.rootpath)
    config.stash[_COVERAGE] = collector
    if _is_worker(config):
        return
    folder = _coverage_folder(config)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if config.option.tmcl_coverage_append:
            collector.read(folder)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise pytest.UsageError(f"--tmcl-coverage={folder}: {reason}") from None


def _is_worker(config: pytest.Config) -> bool:
    """Whether this is a process of pytest-xdist that runs tests for another one."""
    return hasattr(config, "workeroutput")


def _coverage_folder(config: pytest.Config) -> Path:
    return config.invocation_params.dir / config.option.tmcl_coverage


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Take over what a worker of pytest-xdist has collected."""
    collector = node.config.stash.get(_COVERAGE, None)
    output = getattr(node, "workeroutput", {})
    if collector is not None and _SAVED in output:
        collector.load(output[_SAVED])


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the coverage of all tests, or hand it over."""
    collector = session.config.stash.get(_COVERAGE, None)
    if collector is None:
        return
    if _is_worker(session.config):
        cast("Any", session.config).workeroutput[_SAVED] = collector.save()
    else:
        collector.write(_coverage_folder(session.config))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Say how much of each program was executed."""
    collector = config.stash.get(_COVERAGE, None)
    if collector is not None:
        terminalreporter.section("TMCL coverage")
        for line in collector.lines(_coverage_folder(config)):
            terminalreporter.line(line)


# Sessions


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Session files are tests."""
    if file_path.suffix != SUFFIX:
        return None
    file: pytest.Collector = _make(SessionFile, parent, path=file_path)
    return file


def _make(node: Any, parent: pytest.Collector, **keywords: Any) -> Any:
    """A node of pytest's tree, whose constructor has no types."""
    return node.from_parent(parent, **keywords)


class SessionFile(pytest.File):
    """A session file: a test for each case, model and kind of line."""

    def collect(self) -> Iterator[pytest.Item]:
        """Its tests."""
        from tmcm34x.bench.session.errors import SessionSyntaxError
        from tmcm34x.bench.session.language import KINDS, MODELS, load
        from tmcm34x.bench.session.runner import variants

        try:
            cases = load(self.path)
        except SessionSyntaxError as error:
            raise self.CollectError(str(error)) from None
        for case in cases:
            for model, kind in variants(case, MODELS, frozenset(KINDS.values())):
                name = f"{case.title}[{model}-{kind}]"
                yield _make(SessionItem, self, name=name, case=case, model=model, kind=kind)


class SessionItem(pytest.Item):
    """One case on one model over one kind of line."""

    def __init__(self, *, case: Case, model: int, kind: str, **keywords: Any) -> None:
        super().__init__(**keywords)  # pyright: ignore[reportUnknownMemberType]
        self.case, self.model, self.kind = case, model, kind

    def runtest(self) -> None:
        """Play it."""
        if self.config.option.tmcm34x_port:
            self._play_real()
            return
        from tmcm34x.bench.session.runner import make_rig, play
        from tmcm34x.bench.session.wires import open_wire

        play(self.case, open_wire(self.kind, make_rig(self.case, self.model)), self.model)

    def _play_real(self) -> None:
        import time

        from tmcm34x.bench.session.real import kind_of, real_player
        from tmcm34x.bench.session.runner import playable
        from tmcm34x.host import Connection

        option = self.config.option
        module = _real(self.config, self.model, [])
        steps = [] if self.case.bench else playable(self.case, module.model)
        if not steps:
            pytest.skip("needs a bench")
        where = {"baud": option.tmcm34x_baud, "address": option.tmcm34x_address}
        with Connection.open(option.tmcm34x_port, **where) as connection:
            if self.kind != kind_of(connection.line):
                pytest.skip(
                    f"needs {self.kind.replace('can', 'a CAN bus').replace('serial', 'a serial line')}"
                )
            player = real_player(connection, self.case, time.monotonic)
            for step in steps:
                player.play(step)
            player.finish()

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """A failure as `tmcm34x play` shows it."""
        from tmcm34x.bench.session.errors import SessionFailedError

        if isinstance(excinfo.value, SessionFailedError):
            return excinfo.value.report()
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where the case begins."""
        return self.path, self.case.line - 1, self.name
