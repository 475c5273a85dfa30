"""What other languages and habit call the commands and words of TMCL."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

COMMANDS: Final[Mapping[str, str]] = MappingProxyType({
    "JMP": "JA", "JUMP": "JA", "GOTO": "JA", "BRA": "JA", "CALL": "CSUB", "GOSUB": "CSUB", "JSR": "CSUB",
    "BSR": "CSUB", "RET": "RSUB", "RTS": "RSUB", "RETURN": "RSUB", "END": "STOP", "HALT": "STOP", "EXIT": "STOP",
    "DELAY": "WAIT TICKS, 0,", "SLEEP": "WAIT TICKS, 0,", "PAUSE": "WAIT TICKS, 0,", "MSTOP": "MST", "CMP": "COMP",
    "COMPARE": "COMP", "MOVE": "MVP", "JZ": "JC ZE,", "JNZ": "JC NZ,", "JE": "JC EQ,", "JEQ": "JC EQ,",
    "JNE": "JC NE,", "JG": "JC GT,", "JGT": "JC GT,", "JGE": "JC GE,", "JL": "JC LT,", "JLT": "JC LT,", "JLE": "JC LE,",
    "BEQ": "JC EQ,", "BNE": "JC NE,", "ADD": "CALC ADD,", "SUB": "CALC SUB,", "MUL": "CALC MUL,", "DIV": "CALC DIV,",
    "LOAD": "CALC LOAD,",
})  # fmt: skip
"""What a command is called elsewhere, and what TMCL writes there."""

WORDS: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType({
    "JC": {
        "GTE": "GE", "LTE": "LE", "EQUAL": "EQ", "EQUALS": "EQ", "NEQ": "NE", "NOTEQUAL": "NE", "GREATER": "GT",
        "LESS": "LT", "ZERO": "ZE", "NOTZERO": "NZ", "NZE": "NZ", "TIMEOUT": "ETO", "=": "EQ", "==": "EQ", "!=": "NE",
        "<>": "NE", ">": "GT", ">=": "GE", "<": "LT", "<=": "LE",
    },
    "MVP": {"ABSOLUTE": "ABS", "RELATIVE": "REL", "COORDINATE": "COORD"},
    "WAIT": {"TIME": "TICKS", "POSITION": "POS", "REF": "REFSW", "LIMIT": "LIMSW"},
    "CALC": {"PLUS": "ADD", "MINUS": "SUB", "TIMES": "MUL", "SET": "LOAD", "+": "ADD", "-": "SUB", "*": "MUL",
             "/": "DIV"},
    "CALCX": {"PLUS": "ADD", "MINUS": "SUB", "TIMES": "MUL", "EXCHANGE": "SWAP", "XCHG": "SWAP"},
    "RFS": {"BEGIN": "START", "HALT": "STOP", "END": "STOP", "STATE": "STATUS"},
    "CLE": {"TIMEOUT": "ETO"},
})  # fmt: skip
"""The same for the words of each command."""

NOTES: Final[Mapping[str, str]] = MappingProxyType({
    "NOP": "TMCL has no command that does nothing; leave the line out",
    "EQU": "a constant is written NAME = VALUE",
})  # fmt: skip
"""Commands of other languages that have none in their place."""

CHARACTERS: Final[Mapping[str, str]] = MappingProxyType({
    "\u2013": "-", "\u2014": "-", "\u2212": "-", "\u2010": "-", "\u2011": "-", "\u201c": '"', "\u201d": '"',
    "\u201e": '"', "\u2018": "'", "\u2019": "'", "\u00d7": "*", "\u00f7": "/",
    "\u3001": ",", "\u200b": "", "\u200e": "",
    "\u3000": " ", "\u2009": " ", "\u202f": " ", "\u2003": " ", "\u2002": " ",
    **{chr(code + 0xFEE0): chr(code) for code in range(0x21, 0x7F)},
})  # fmt: skip
"""Characters of word processors and wide keyboards, and the plain ones that are meant."""

LETTERS: Final[Mapping[str, str]] = MappingProxyType({
    "ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "é": "e", "è": "e", "ê": "e", "à": "a",
    "á": "a", "å": "a", "ø": "o", "æ": "ae", "ç": "c", "ñ": "n", "ó": "o", "í": "i", "ú": "u",
})  # fmt: skip
"""Letters that no name may have, in the letters that names have."""
