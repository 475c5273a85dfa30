"""Commands as people type them: names stand for the numbers of parameters.

    GAP actual_position, 0
    SGP can_id, 0, 5
    SGP user_variable_3, 2, 17
    version

Source: manual 6.5; names are the keys of the tables, and the titles of control functions with _ for blanks.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
from tmcm34x.tmcl.commands import BY_MNEMONIC, CONTROL_FUNCTIONS, Operand
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS
from tmcm34x.tmcl.mnemonic import MnemonicError, parse_instruction
from tmcm34x.toolchain.mending.spelling import proposal

CONTROLS: Final = {row.title.replace(" ", "_").lower(): row.number for row in CONTROL_FUNCTIONS}
"""Numbers of control functions by title: `stop_application`, `get_firmware_version`."""
_TABLES: Final = {"axis_parameter": AXIS_KEYS, "global_parameter": GLOBAL_KEYS}


def parse_line(line: str) -> Instruction:
    """The command in a line.  Raises `MnemonicError`."""
    words = line.split("//", maxsplit=1)[0].replace(",", " ").split()
    if not words:
        raise MnemonicError("no command", known=False)
    name = words[0].lower()
    if name in CONTROLS:
        return parse_instruction(" ".join([str(CONTROLS[name]), *words[1:]]))
    row = BY_MNEMONIC.get(words[0].upper())
    operands = () if row is None else row.operands
    numbers = [_number(operand, word) for operand, word in zip(operands, words[1:], strict=False)]
    return parse_instruction(" ".join([words[0], *numbers, *words[1 + len(numbers) :]]))


def _number(operand: Operand, word: str) -> str:
    """The number of a parameter that is given by its name; everything else as it is."""
    table = _TABLES.get(operand.kind)
    if table is None or not (word[0].isalpha() or word[0] == "_"):
        return word
    row = table.get(word.lower())
    if row is not None:
        return str(row.number)
    kind = operand.kind.replace("_", " ")
    raise MnemonicError(f"there is no {kind} {word}{proposal(word.lower(), table)}")
