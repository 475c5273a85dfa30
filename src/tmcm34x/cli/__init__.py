"""The command line: a group of sub-commands, each imported only when it is called.

A sub-command's module exports a click command named `command`, or as the row says.  Exit statuses: 0 done, 1
diagnostics about the user's files or a result that says no (modules differ, a backup is incomplete), 2 wrong usage or
something the system refuses, 3 no reply from the module, 4 the module refuses; from 2 on with one line on standard
error.
"""

from __future__ import annotations

import errno
import math
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TextIO

import click

from tmcm34x import __version__
from tmcm34x.interrupts import STATUS, Leaving, leave_on_interrupt

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class SubCommand(NamedTuple):
    """One row of `SUB_COMMANDS`."""

    name: str
    module: str
    help: str
    attribute: str = "command"
    """Of the module: the click command."""


SUB_COMMANDS: Final = (
    SubCommand("ide", "tmcm34x.cli.ide", "Open the TMCL-IDE in the browser."),
    SubCommand("serve", "tmcm34x.cli.serve", "Serve a virtual module on serial ports and sockets."),
    SubCommand("bench", "tmcm34x.cli.bench", "Control the bench of a running `serve --control`."),
    SubCommand("run", "tmcm34x.cli.run", "Run a TMCL program in virtual time."),
    SubCommand("sweep", "tmcm34x.cli.sweep", "Run a program many times with values that change."),
    SubCommand("play", "tmcm34x.cli.play", "Play sessions against a virtual or a real module."),
    SubCommand("record", "tmcm34x.cli.record", "Record the telegrams between a host and a module."),
    SubCommand("show", "tmcm34x.cli.show", "Show a recording, or write it in another form."),
    SubCommand("check", "tmcm34x.cli.check", "Compare a recording with the virtual module."),
    SubCommand("asm", "tmcm34x.cli.asm", "Assemble a TMCL program."),
    SubCommand("dis", "tmcm34x.cli.dis", "Turn a program image back into source."),
    SubCommand("fmt", "tmcm34x.cli.fmt", "Lay TMCL source out in columns."),
    SubCommand("lint", "tmcm34x.cli.lint", "Point out likely mistakes in TMCL programs."),
    SubCommand("scan", "tmcm34x.cli.host.scan", "Find modules on serial ports, sockets and CAN."),
    SubCommand("send", "tmcm34x.cli.host.send", "Send commands to a module and show the replies."),
    SubCommand("console", "tmcm34x.cli.host.console", "Talk to a module, with completion and help."),
    SubCommand("status", "tmcm34x.cli.host.control", "Show what a module is doing.", "status"),
    SubCommand("why", "tmcm34x.cli.host.why", "Explain why a motor does not turn."),
    SubCommand("monitor", "tmcm34x.cli.host.monitor", "Watch a module: a live table, a plot, CSV."),
    SubCommand(
        "download", "tmcm34x.cli.host.memory", "Store a program in a module and verify it.", "download"
    ),
    SubCommand("upload", "tmcm34x.cli.host.memory", "Read the program out of a module.", "upload"),
    SubCommand("start", "tmcm34x.cli.host.control", "Start the program of a module.", "start"),
    SubCommand("stop", "tmcm34x.cli.host.control", "Stop the program of a module, or all motors.", "stop"),
    SubCommand("step", "tmcm34x.cli.host.control", "Execute one command of the program of a module.", "step"),
    SubCommand("reset", "tmcm34x.cli.host.control", "Stop the program and go back to its start.", "reset"),
    SubCommand("settings", "tmcm34x.cli.host.settings", "Save, load, compare and store settings."),
    SubCommand("backup", "tmcm34x.cli.host.backup", "Save a whole module in one text file.", "backup"),
    SubCommand("restore", "tmcm34x.cli.host.backup", "Bring a backup back into a module.", "restore"),
    SubCommand("clone", "tmcm34x.cli.host.backup", "Make one module equal to another.", "clone"),
    SubCommand("compare", "tmcm34x.cli.host.backup", "Compare two modules or backups.", "compare"),
    SubCommand("factory-reset", "tmcm34x.cli.host.control", "Restore the factory settings.", "factory_reset"),
    SubCommand("units", "tmcm34x.cli.host.units", "Convert speeds, accelerations and distances."),
    SubCommand("lsp", "tmcm34x.cli.lsp", "Serve the language server for editors."),
    SubCommand("dap", "tmcm34x.cli.dap", "Serve the debug adapter for editors."),
    SubCommand("completion", "tmcm34x.cli.completion", "Complete commands by Tab in bash, zsh or fish."),
)
_BY_NAME: Final = {row.name: row for row in SUB_COMMANDS}


class CliError(click.ClickException):
    """Something that the user can mend: one line on standard error and exit status 2."""

    exit_code = 2

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.ctx = click.get_current_context(silent=True)


class FiniteRange(click.FloatRange):
    """A `FloatRange` that takes neither `nan` nor `inf`."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a usage error."""
        if not math.isfinite(click.FLOAT.convert(value, param, ctx)):
            self.fail(f"{value} must be a finite number.", param, ctx)
        return super().convert(value, param, ctx)


class _Group(click.Group):
    """Knows its sub-commands from the table and imports the one that is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [row.name for row in SUB_COMMANDS]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        row = _BY_NAME.get(cmd_name)
        if row is None:
            return None
        with Leaving():
            command = getattr(import_module(row.module), row.attribute)
        assert isinstance(command, click.Command)
        return command

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """The commands from the table, so that none is imported; options as in any command."""
        from click.shell_completion import CompletionItem

        named = [row for row in SUB_COMMANDS if row.name.startswith(incomplete)]
        options = click.Command.shell_complete(self, ctx, incomplete) if incomplete.startswith("-") else []
        return [*(CompletionItem(row.name, help=row.help) for row in named), *options]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(row.name, row.help) for row in SUB_COMMANDS])


def _show_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or ctx.resilient_parsing:
        return
    click.echo(f"tmcm34x {__version__}")
    if ctx.params.get("verbose"):
        core = import_module("tmcm34x.clock").__file__ or ""
        kind = "Python" if core.endswith(".py") else "compiled"
        click.echo(f"core: {kind}\nPython {sys.version.split()[0]} on {sys.platform}")
    ctx.exit()


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--verbose", is_flag=True, is_eager=True, help="With --version: also the core and the platform."
)
@click.option(
    "--version", is_flag=True, expose_value=False, callback=_show_version,
    help="Show the version and exit.",
)  # fmt: skip
def group(verbose: bool) -> None:
    """A software TMCM-341/342/343: three-axis stepper module, TMCL firmware V4.36, and its tools."""
    del verbose


def main() -> None:
    """Do what the arguments of the process say, and end it."""
    status = run(sys.argv[1:])
    leave_on_interrupt()
    sys.exit(status)


def run(arguments: list[str]) -> int:
    """Do what the arguments say; returns the exit status."""
    try:
        status = group.main(arguments, prog_name="tmcm34x", standalone_mode=False)
        _flush()
    except click.ClickException as error:
        return _complain(error)
    except (click.Abort, KeyboardInterrupt):
        return STATUS
    except OSError as error:
        if not _output_failed(error):
            raise
        return _say_failure(error)
    return status if isinstance(status, int) else 0


def _flush() -> None:
    """What cannot be written is to be found out here, not by Python at exit; the language server has closed it."""
    if sys.stdout is not None and not sys.stdout.closed:  # pyright: ignore[reportUnnecessaryComparison]
        sys.stdout.flush()


def _output_failed(error: OSError) -> bool:
    """Whether it is standard output or standard error that could not be written; that one is then given up."""
    failed = [stream for stream in (sys.stdout, sys.stderr) if not _takes(stream, error)]
    for stream in failed:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return bool(failed)


def _takes(stream: TextIO, error: OSError) -> bool:
    """Whether a stream takes more; a file on a full disk forgets its failure, and is tried with one more byte."""
    try:
        stream.flush()
        if error.errno in _FULL and stream is sys.stdout:
            os.write(stream.fileno(), b"\n")
    except OSError:
        return False
    return True


_FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})


def _say_failure(error: OSError) -> int:
    """Whoever reads the output may have enough of it: then there is nothing to say."""
    if isinstance(error, BrokenPipeError):
        return 1
    click.echo(f"tmcm34x: standard output: {error.strerror}", err=True)
    return CliError.exit_code


def _complain(error: click.ClickException) -> int:
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        error.show()
        return error.exit_code
    context: click.Context | None = getattr(error, "ctx", None)
    name = context.command_path if context else "tmcm34x"
    click.echo(f"{name}: {error.format_message()}", err=True)
    return max(error.exit_code, CliError.exit_code)


def spare_the_collector() -> None:
    """Look for garbage less often: judging a program makes 100,000 objects, none of which is garbage yet.

    For commands that judge programs after each keystroke; it takes a quarter off, and half off the longest waits.
    """
    import gc

    gc.freeze()
    gc.set_threshold(50_000, 10, 10)
