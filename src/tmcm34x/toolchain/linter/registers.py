"""Rules about the accumulator, the register X and the flags: used before they are set, set and never used.

Two analyses over the control flow.  Forwards, what may have been set on some way to an address: a use of anything
else is a use before it was set.  Backwards, whether the accumulator may still be used: a value that is read into it
where it is not is lost.  A subroutine may set everything, and use everything that its callers go on with.

Source: manual 6.7.16 to 6.7.20 and 6.7.29 to 6.7.31.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import COMMAND
from tmcm34x.toolchain.flow import CSUB, RSUB, Flow
from tmcm34x.toolchain.linter.findings import Findings
from tmcm34x.toolchain.linter.fixes import insertion, removal

A, X, COMPARED, ALL = 1, 2, 4, 7
"""Bits of a set: accumulator, register X, result of COMP."""


class Effect(NamedTuple):
    """What a command uses and sets, as sets of bits; `loads`: it sets the accumulator to a value from elsewhere."""

    uses: int = 0
    sets: int = 0
    loads: bool = False


_WORDS: Final = {row.mnemonic: dict(row.operands[0].words) for row in COMMANDS if row.operands}
_LOAD: Final = _WORDS["CALC"]["LOAD"]
_CALCX: Final = {
    _WORDS["CALCX"]["LOAD"]: Effect(A, X),
    _WORDS["CALCX"]["SWAP"]: Effect(A | X, A | X),
}
_RESULT: Final = frozenset({_WORDS["JC"]["ZE"], _WORDS["JC"]["NZ"]})
_COMPARISON: Final = frozenset(_WORDS["JC"][word] for word in ("EQ", "NE", "GT", "GE", "LT", "LE"))
_READS: Final = frozenset({COMMAND.GAP, COMMAND.GGP, COMMAND.GIO})
_WRITES: Final = frozenset({COMMAND.AAP, COMMAND.AGP, COMMAND.ACO})
_USER: Final = range(COMMAND.UF0, COMMAND.UF7 + 1)
_COPY: Final = 255
_FROM_ACCUMULATOR: Final = -1
_ALL_PORTS: Final = 255
_SENDS_ACCUMULATOR: Final = 0x80
_NOTHING: Final = Effect()
_READ: Final = Effect(0, A, loads=True)
_STATUS: Final = _WORDS["RFS"]["STATUS"]
_FIXED: Final = {
    COMMAND.COMP: Effect(A, COMPARED), **dict.fromkeys(_WRITES, Effect(A)), **dict.fromkeys(_USER, Effect(A | X, ALL)),
}  # fmt: skip
"""Commands that always do the same."""
_BY_TYPE: Final[Mapping[int, Callable[[int], Effect]]] = {
    COMMAND.CALC: lambda type_: _READ if type_ == _LOAD else Effect(A, A),
    COMMAND.CALCX: lambda type_: _CALCX.get(type_, Effect(A | X, A)),
    COMMAND.JC: lambda type_: Effect(A if type_ in _RESULT else COMPARED if type_ in _COMPARISON else 0),
    COMMAND.RFS: lambda type_: _READ if type_ == _STATUS else _NOTHING,
    COMMAND.SAC: lambda type_: Effect(A if type_ >= _SENDS_ACCUMULATOR else 0, A),
}
"""Commands whose type field decides."""


def effect(instruction: Instruction) -> Effect:
    """What a command uses and sets; CSUB is left to the analyses."""
    number, type_, motor, value = instruction
    if number in _BY_TYPE:
        return _BY_TYPE[number](type_)
    if number in _READS or (number == COMMAND.GCO and motor != _COPY):
        return _READ
    if number == COMMAND.SIO and type_ == _ALL_PORTS and value == _FROM_ACCUMULATOR:
        return Effect(A)
    return _FIXED.get(number, _NOTHING)


def check_registers(found: Findings, flow: Flow) -> None:
    """Report registers used before they are set (W501, W503) and values that are lost (W502)."""
    effects = [_NOTHING if i is None else effect(i) for i in flow.program]
    _unset(found, flow, effects)
    _lost(found, flow, effects)


_MISSING: Final = (
    (COMPARED, "W503", "no COMP comes before this comparison"),
    (A, "W501", "the accumulator is used here before anything was loaded into it"),
    (X, "W501", "X is used here before CALCX LOAD or SWAP"),
)


def _unset(found: Findings, flow: Flow, effects: list[Effect]) -> None:
    """The first use of each register that nothing has set; a comparison that was never made is of the accumulator."""
    before = _set_before(flow, effects)
    told = 0
    for address in sorted(flow.reachable - {flow.end}):
        missing = effects[address].uses & ~before[address]
        if missing & COMPARED:
            effects[address] = Effect(A)
        messages = {code: text for register, code, text in _MISSING if missing & register & ~told}
        for code, text in messages.items():
            where = found.assembly.code[address]
            fixes = insertion(found, [where], "COMP  0") if code == "W503" else ()
            found.report(code, where.location, text, fixes)
        told |= missing


def _set_before(flow: Flow, effects: list[Effect]) -> list[int]:
    """What may have been set before each address."""
    before = [0] * (flow.end + 1)
    waiting = list(flow.entries)
    seen = set(waiting)
    while waiting:
        address = waiting.pop()
        if address >= flow.end:
            continue
        after = before[address] | effects[address].sets
        called = flow.calls.get(address)
        for following in flow.edges[address]:
            new = before[following] | (ALL if called is not None and following != called else after)
            if new != before[following] or following not in seen:
                before[following] = new
                seen.add(following)
                waiting.append(following)
    return before


def _lost(found: Findings, flow: Flow, effects: list[Effect]) -> None:
    """Values that are read into the accumulator where it is not used any more."""
    after = _used_after(flow, effects)
    for address in sorted(flow.reachable):
        if address < flow.end and effects[address].loads and not after[address]:
            text = "the value read here is overwritten or never used"
            where = found.assembly.code[address]
            fixes = removal(found, where) if _is_harmless(flow.program[address]) else ()
            found.report("W502", where.location, text, fixes)


def _is_harmless(instruction: Instruction | None) -> bool:
    """Whether reading does nothing else in the module."""
    assert instruction is not None
    number, type_, bank, _ = instruction
    rows = {
        COMMAND.GAP: axis_parameters.BY_NUMBER.get(type_),
        COMMAND.GGP: global_parameters.BY_NUMBER.get((bank, type_)),
    }
    row = rows.get(number)
    return row is None or not row.effect


def _used_after(flow: Flow, effects: list[Effect]) -> list[bool]:
    """Whether the accumulator may be used after each address before it is set again."""
    number_of = [-1 if i is None else i.number for i in flow.program]
    before: list[list[int]] = [[] for _ in range(flow.end + 1)]
    returns = [address for address, number in enumerate(number_of) if number == RSUB]
    for address in range(flow.end):
        for following in flow.edges[address]:
            before[following].append(address)
        if number_of[address] == CSUB:
            before[address + 1] += returns
    used = [False] * (flow.end + 1)
    waiting = [n for n, one in enumerate(effects) if one.uses & A]
    alive = set(waiting)
    while waiting:
        for address in before[waiting.pop()]:
            used[address] = True
            if address not in alive and not effects[address].sets & A:
                alive.add(address)
                waiting.append(address)
    return used
