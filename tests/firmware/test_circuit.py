"""The firmware knows its board by datagrams and pins alone: real chips could stand in for the models."""

import ast
from pathlib import Path

import pytest

import tmcm34x.board
import tmcm34x.firmware
from firmware.hosts import Host
from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import assemble

FIRMWARE = Path(tmcm34x.firmware.__path__[0])
SOURCES = sorted(FIRMWARE.rglob("*.py"))
GRID = MS
"""How often the firmware looks at chips that cannot say when something will happen."""


def members():
    """The names of a `Circuit`, from its source: a compiled class has no annotations."""
    tree = ast.parse((Path(tmcm34x.board.__path__[0]) / "circuit.py").read_text(encoding="utf-8"))
    (circuit,) = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "Circuit")
    for node in circuit.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name
        elif isinstance(node, ast.AnnAssign):
            yield node.target.id


MEMBERS = set(members())


class LookedAt:
    """A board with chips that answer datagrams and do nothing else; the world keeps the other side of it."""

    def __init__(self, board):
        self._board = board

    def next_event(self):
        return (self._board.now // GRID + 1) * GRID

    def changed_motors(self):
        return 7

    def __getattr__(self, name):
        if name not in MEMBERS:
            raise AttributeError(name)
        return getattr(self._board, name)


def module_on(kind, model=343):
    board = Board(MODELS[model])
    module = FirmwareModule(kind(board), Eeprom(model))
    module.power_on()
    return module, Host(module), board


def board_members(source):
    """What a file of the firmware asks of a board: attributes of `board`, `circuit` and `X.circuit`."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute):
            owner = node.value
            name = getattr(owner, "attr", getattr(owner, "id", ""))
            if name in {"board", "circuit"}:
                yield node.attr


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(FIRMWARE)))
def test_the_firmware_asks_its_board_for_nothing_but_a_circuit(path):
    source = path.read_text(encoding="utf-8")
    assert set(board_members(source)) <= MEMBERS
    assert "chips.tmc429" not in source


def test_every_member_of_a_circuit_is_asked_for():
    asked = {name for path in SOURCES for name in board_members(path.read_text(encoding="utf-8"))}
    assert asked == MEMBERS


@pytest.mark.parametrize("model", [341, 342, 343])
def test_a_module_works_with_chips_that_cannot_say_when_something_happens(model):
    _, modelled, _ = module_on(lambda board: board, model)
    module, host, _ = module_on(LookedAt, model)
    for each in (modelled, host):
        for line in ("MVP ABS, 0, 20000", "ROR 1, 500", "MVP REL, 2, -3000", "138 0, 0, 5"):
            each.send(*parse_instruction(line))
        each.wait_ms(3000)
    assert host.replies() == modelled.replies()
    for line in ("GAP 1, 0", "GAP 8, 0", "GAP 3, 1", "GAP 1, 2", "GAP 1, 1", "GAP 3, 0"):
        assert host.do(line) == modelled.do(line), line
    assert module.now == modelled.module.now


def test_a_program_waits_for_the_position_of_such_a_chip():
    module, host, _ = module_on(LookedAt)
    module.eeprom.write_program(
        assemble("MVP ABS, 0, 5000\nWAIT POS, 0, 0\nGAP 1, 0\nAGP 5, 2\nSTOP\n").program
    )
    host.do("129 0, 0, 0")
    run_until(module, 2000 * MS)
    assert host.do("GGP 5, 2") == 5000


def test_a_reference_search_and_a_stop_switch_need_no_more():
    module, host, board = module_on(LookedAt)
    host.do("RFS START, 0")
    run_until(module, 500 * MS)
    assert host.do("GAP 3, 0") < 0
    board.set_switch(0, "left", True)
    run_until(module, 1000 * MS)
    board.set_switch(0, "left", False)
    run_until(module, 1500 * MS)
    board.set_switch(0, "left", True)
    run_until(module, 3000 * MS)
    assert host.do("RFS STATUS, 0") == 0
    host.do("ROL 1, 300")
    run_until(module, 3500 * MS)
    assert host.do("GAP 3, 1") == -300
    board.set_switch(1, "left", True)
    run_until(module, 4000 * MS)
    assert host.do("GAP 3, 1") == 0
