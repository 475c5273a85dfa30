"""Commands, control functions and parameters have names in code: `tmcm34x.tmcl.numbers`, not bare numbers.

A number counts as bare where it picks a parameter out of values (`values[4]`), makes an `Instruction`, is written to
the EEPROM as a parameter, is looked up in a table by number, is compared with the number of a command, or is a
constant with the number of a control function (other than 128, which is many things).
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parent.parent / "src" / "tmcm34x"
ROWS = {"tmcl"}
"""Where the numbers are."""
PACKAGES = sorted(path.name for path in SOURCE.iterdir() if any(path.glob("*.py")) and path.name not in ROWS)
BY_NUMBER = {"values", "global_values", "axis_values", "BY_NUMBER"}
"""Names of what is indexed by number."""
NUMBERED = {"Instruction": 0, "set_global_value": 0, "set_axis_value": 1}
"""Position of the number among the arguments of a call."""
COMMAND_NAMES = {"number", "command"}
CONTROL = {*range(128, 140), 242}


def name_of(node: ast.AST) -> str:
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case ast.Subscript(value=value):
            return name_of(value)
        case _:
            return ""


def integers(node: ast.AST) -> set[int]:
    """Integer constants that an expression is made of, in sets and tuples too."""
    match node:
        case ast.Constant(value=int(value)) if not isinstance(value, bool):
            return {value}
        case ast.Tuple(elts=items) | ast.Set(elts=items) | ast.List(elts=items):
            return set().union(*map(integers, items))
        case _:
            return set()


def is_bare(node: ast.AST) -> bool:
    match node:
        case ast.Subscript(value=value, slice=key):
            return name_of(value) in BY_NUMBER and bool(integers(key) - {0, 1, 2})
        case ast.Call(func=ast.Attribute(value=value, attr="get"), args=[key, *_]):
            return name_of(value) in BY_NUMBER and bool(integers(key) - {0, 1, 2})
        case ast.Call(func=function, args=arguments) if name_of(function) in NUMBERED:
            position = NUMBERED[name_of(function)]
            return len(arguments) > position and bool(integers(arguments[position]) - {0})
        case ast.Compare(left=left, comparators=right):
            sides = [left, *right]
            named = any(name_of(side) in COMMAND_NAMES for side in sides)
            return named and any(integers(side) & CONTROL for side in sides)
        case ast.AnnAssign(target=ast.Name(id=name), value=ast.Constant(value=int(value))):
            return name.lstrip("_").isupper() and value in CONTROL - {128}
        case _:
            return False


def bare(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if is_bare(node):
            yield f"{path.relative_to(SOURCE)}:{node.lineno}: {ast.unparse(node)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_commands_and_parameters_have_names(package):
    found = [line for path in sorted((SOURCE / package).rglob("*.py")) for line in bare(path)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "text",
    [
        "axis.values[4]", "eeprom.global_values[84]", "axis.values.get(205)", "Instruction(131)",
        "eeprom.set_global_value(73, 1)", "eeprom.set_axis_value(0, 4, 5)", "BY_NUMBER[137]", "number == 136",
        "number in {133, 136}", "if command != 139: pass", "QUIT_DOWNLOAD: Final = 133",
    ],
)  # fmt: skip
def test_the_search_finds_bare_numbers(text):
    assert any(is_bare(node) for node in ast.walk(ast.parse(text)))
