"""Downloads over lines with faults, interrupted and refused."""

import pytest

from host_rigs import PROGRAM, connected, faulty, module_of
from tmcm34x.host import (
    DownloadModeError,
    GarbledReplyError,
    HostError,
    NoReplyError,
    ProtectedError,
    VerifyError,
    program,
)
from tmcm34x.host.steps import value
from tmcm34x.tmcl.datagram import Instruction

LONG = PROGRAM * 30


@pytest.mark.parametrize(
    "fault",
    ["garble,probability=0.077", "drop,probability=0.05", "drop=3,probability=0.05", "late_reply,probability=0.05",
     "duplicate,probability=0.1", "stray=2,probability=0.1", "silent,probability=0.05", "status=1,probability=0.05",
     "delay=1200,probability=0.02", "split=50,probability=0.1"],
)  # fmt: skip
def test_a_download_over_a_bad_line_is_whole(fault):
    connection = connected(faults=faulty(fault, seed=4), retries=8)
    connection.run(program.download(LONG))
    eeprom = module_of(connection).eeprom
    assert tuple(eeprom.read_instruction(n) for n in range(len(LONG))) == LONG
    assert connection.run(program.upload()) == LONG
    assert connection.run(value(Instruction(10, 129))) == 0


@pytest.mark.parametrize("at", [1, 7, 60, 84])
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_download_leaves_download_mode(at, error):
    def progress(done, total):
        if done == at:
            raise error

    connection = connected()
    with pytest.raises(error):
        connection.run(program.download(PROGRAM, progress=progress))
    assert connection.run(value(Instruction(10, 129))) == 0


@pytest.mark.parametrize("moment", [5, 60])
def test_a_module_that_loses_power_in_the_middle_is_said(moment):
    def progress(done, total):
        if done == moment:
            module_of(connection).power_off()

    connection = connected(retries=1, timeout_s=0.2)
    with pytest.raises(NoReplyError, match="check power"):
        connection.run(program.download(PROGRAM, progress=progress))


def test_a_module_that_restarts_in_the_middle_is_not_called_programmed():
    """After the restart it executes what was meant to be stored: the download notices at the first status 100."""
    connection = connected()

    def progress(done, total):
        if done == 5:
            module_of(connection).power_off()
            module_of(connection).power_on()

    with pytest.raises(HostError):
        connection.run(program.download([Instruction(9, n, 2, 1) for n in range(40)], progress=progress))


def test_a_module_found_in_download_mode_is_freed_and_said():
    connection, said = connected(), []
    connection.ask(Instruction(132))
    connection.run(program.download(PROGRAM, tell=said.append))
    assert said == [
        "The module was in download mode, perhaps from an interrupted download; it has left it (133)."
    ]
    assert connection.run(program.upload()) == PROGRAM


def test_any_command_recognizes_download_mode():
    connection = connected()
    connection.ask(Instruction(132))
    with pytest.raises(DownloadModeError, match="tmcm34x stop"):
        connection.run(value(Instruction(6, 4)))
    connection.run(program.stop())
    assert connection.run(value(Instruction(6, 4))) == 1000


def test_protection_is_told_from_other_refusals():
    connection = connected()
    connection.run(program.download(PROGRAM))
    connection.command(9, 81, 0, 3)
    with pytest.raises(ProtectedError):
        connection.run(program.upload())
    with pytest.raises(ProtectedError):
        connection.run(program.download(PROGRAM))
    assert connection.run(value(Instruction(10, 129))) == 0


def test_two_hosts_at_once_are_noticed():
    """Another host stores an instruction in the middle: the memory is not what was to be stored."""
    connection = connected()
    other = connected(connection.line.rig)

    def progress(done, total):
        if done == 20:
            other.ask(Instruction(3, 0, 1))

    with pytest.raises(VerifyError, match="address 20: MST 1 instead of SGP 20"):
        connection.run(program.download(PROGRAM, progress=progress))


def test_a_line_that_damages_everything_ends_and_leaves_no_doubt():
    connection = connected(faults=faulty("garble=3"), retries=1, timeout_s=0.1)
    with pytest.raises(GarbledReplyError, match="check the bit rate, the wiring"):
        connection.run(program.download(PROGRAM))
