"""The command itself: what holds for all sub-commands."""

import subprocess
import sys
from pathlib import Path

import click
import pytest

from tmcm34x import __version__
from tmcm34x.cli import SUB_COMMANDS, group

COMMAND = Path(sys.executable).with_name("tmcm34x")


def tmcm34x(*arguments):
    return subprocess.run([COMMAND, *arguments], capture_output=True, text=True, check=False, timeout=60)


def test_version():
    result = tmcm34x("--version")
    assert (result.returncode, result.stdout) == (0, f"tmcm34x {__version__}\n")


def test_help_names_every_sub_command_without_importing_one():
    script = (
        "import sys; from tmcm34x.cli import group\n"
        "group.main(['--help'], standalone_mode=False)\n"
        "heavy = {'asyncio', 'serial', 'tmcm34x.firmware', 'tmcm34x.toolchain'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    for row in SUB_COMMANDS:
        assert f"  {row.name} " in result.stdout


@pytest.mark.parametrize("row", SUB_COMMANDS, ids=lambda row: row.name)
def test_every_sub_command_explains_itself(row):
    context = group.make_context("tmcm34x", [], resilient_parsing=True)
    command = group.get_command(context, row.name)
    text = command.get_help(command.make_context(row.name, [], parent=context, resilient_parsing=True))
    assert text.startswith(f"Usage: tmcm34x {row.name}")
    options = [parameter for parameter in command.params if parameter.param_type_name == "option"]
    assert all(option.help for option in options), [option.name for option in options if not option.help]


def test_without_arguments_it_shows_its_help():
    result = tmcm34x()
    assert result.returncode == 2
    assert result.stderr.startswith("Usage: tmcm34x")


def test_an_unknown_sub_command_is_one_line():
    result = tmcm34x("sirve")
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("tmcm34x: No such command 'sirve'")


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "x.tmc", "--until", "inf"),
        ("run", "x.tmc", "--until", "nan"),
        ("run", "x.tmc", "--sample", "inf"),
        ("run", "x.tmc", "--instruction-time", "nan"),
        ("serve", "--instruction-time", "nan"),
        ("serve", "--speed", "nan"),
        ("serve", "--speed", "inf"),
    ],
    ids=" ".join,
)
def test_numbers_that_are_none_are_refused(arguments):
    with pytest.raises(click.BadParameter, match="must be a finite number"):
        group.main(arguments, standalone_mode=False)


def test_the_module_is_the_command():
    result = subprocess.run(
        [sys.executable, "-m", "tmcm34x", "--version"], capture_output=True, text=True, check=True
    )
    assert result.stdout == f"tmcm34x {__version__}\n"


def test_a_reader_that_leaves_early_gets_no_traceback():
    with subprocess.Popen(
        [COMMAND, "serve", "--help"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
