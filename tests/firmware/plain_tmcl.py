"""Register commands of TMCL, one at a time and as plainly as possible: what `firmware.program.machine` must equal."""

from __future__ import annotations

from dataclasses import dataclass, field

from tmcm34x.tmcl.datagram import Instruction

WORDS = {19: ["ADD", "SUB", "MUL", "DIV", "MOD", "AND", "OR", "XOR", "NOT", "LOAD"]}
WORDS[33] = [*WORDS[19], "SWAP"]
CONDITIONS = ["ZE", "NZ", "EQ", "NE", "GT", "GE", "LT", "LE", "ETO", "EAL", "EDV", "EPO", "ESD"]
FLAGS = ["ALL", "ETO", "EAL", "EDV", "EPO", "ESD"]


def signed(value: int) -> int:
    value %= 2**32
    return value - 2**32 if value >= 2**31 else value


def divide(dividend: int, divisor: int) -> tuple[int, int]:
    if divisor == 0:
        return dividend, dividend
    quotient = abs(dividend) // abs(divisor)
    if (dividend < 0) != (divisor < 0):
        quotient = -quotient
    return signed(quotient), dividend - quotient * divisor


@dataclass
class Plain:
    """A program and its registers."""

    memory: list[Instruction]
    accumulator: int = 0
    x: int = 0
    counter: int = 0
    stack: list[int] = field(default_factory=list)
    flags: set[str] = field(default_factory=set)
    variables: list[int] = field(default_factory=lambda: [0] * 56)

    def step(self) -> bool:
        """Execute one command; False, and nothing done, if it is a module command."""
        number, type_, motor, value = self.memory[self.counter]
        if number in (21, 22, 23) and not 0 <= value < 2048:
            return False
        following = self.counter + 1
        if number in WORDS and type_ < len(WORDS[number]):
            self.calculate(WORDS[number][type_], value if number == 19 else self.x, number == 33)
        elif number == 20:
            self.flags -= {"zero", "equal", "lower", "greater"}
            difference = self.accumulator - value
            self.flags |= {"zero", "equal"} if difference == 0 else {"lower" if difference < 0 else "greater"}
        elif number == 21 and type_ < len(CONDITIONS):
            following = value if self.holds(CONDITIONS[type_]) else following
        elif number == 22:
            following = value
        elif number == 23:
            if len(self.stack) < 8:
                self.stack.append(following)
                following = value
        elif number == 24:
            following = self.stack.pop() if self.stack else following
        elif number == 36 and type_ < len(FLAGS):
            self.flags -= set(FLAGS) if type_ == 0 else {FLAGS[type_]}
        elif number in (9, 10, 35) and motor == 2 and type_ < 56:
            if number == 10:
                self.result(self.variables[type_])
                self.accumulator = self.variables[type_]
            else:
                self.variables[type_] = value if number == 9 else self.accumulator
        else:
            return False
        self.counter = following
        return True

    def result(self, value: int) -> None:
        self.flags.discard("zero")
        if value == 0:
            self.flags.add("zero")

    def holds(self, condition: str) -> bool:
        flags = self.flags
        return {
            "ZE": "zero" in flags,
            "NZ": "zero" not in flags,
            "EQ": "equal" in flags,
            "NE": "equal" not in flags,
            "GT": "greater" in flags,
            "GE": bool({"greater", "equal"} & flags),
            "LT": "lower" in flags,
            "LE": bool({"lower", "equal"} & flags),
        }.get(condition, condition in flags)

    def calculate(self, word: str, operand: int, with_x: bool) -> None:
        accumulator = self.accumulator
        if with_x and word == "NOT":
            self.x = ~self.x
            self.result(self.x)
        elif with_x and word == "LOAD":
            self.x = accumulator
            self.result(accumulator)
        elif word == "SWAP":
            self.accumulator, self.x = self.x, accumulator
            self.result(self.accumulator)
        else:
            self.accumulator = {
                "ADD": signed(accumulator + operand),
                "SUB": signed(accumulator - operand),
                "MUL": signed(accumulator * operand),
                "DIV": divide(accumulator, operand)[0],
                "MOD": divide(accumulator, operand)[1],
                "AND": accumulator & operand,
                "OR": accumulator | operand,
                "XOR": accumulator ^ operand,
                "NOT": ~accumulator,
                "LOAD": operand,
            }[word]
            self.result(self.accumulator)
