"""Repairs of one line: what was meant by a line that is no sound one.

`REPAIRS` is the table, the most certain kind first.  Each entry proposes changes; the first whose result is a sound
line is taken.  Where several results are as good, all are named and none is offered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Final

from tmcm34x.toolchain import parser
from tmcm34x.toolchain.mending import definitions, punctuation, vocabulary
from tmcm34x.toolchain.mending.soundness import sound
from tmcm34x.toolchain.mending.text import LONGEST, Repair, TakenApart, changed, take_apart


@lru_cache(maxsize=4096)
def repair(text: str, labels: frozenset[str] = frozenset()) -> Repair | None:
    """What was meant by a line; None where that cannot be determined.

    labels: those of the file, in upper case
    """
    if len(text) > LONGEST:
        return None
    line = take_apart(text, labels)
    for propose in REPAIRS:
        for proposal in propose(line):
            if not proposal.changes or sound(parser.parse_line(changed(text, proposal.changes))):
                return proposal
    return None


def guess(text: str) -> Repair | None:
    """What a line may have meant that no repair fits; None where that cannot be determined."""
    return None if len(text) > LONGEST else next(vocabulary.guess(take_apart(text, frozenset())), None)


REPAIRS: Final[tuple[Callable[[TakenApart], Iterator[Repair]], ...]] = (
    punctuation.characters, punctuation.end_of_file, vocabulary.symbol_for_word, vocabulary.meaning,
    vocabulary.misspelt, definitions.directive, definitions.constant, punctuation.comma_after_command,
    punctuation.parentheses, punctuation.at_the_end, punctuation.commas, definitions.label, vocabulary.glued,
    punctuation.comment, punctuation.separators, punctuation.missing_comma, vocabulary.split, punctuation.prefix,
    definitions.line_number, vocabulary.calcx, vocabulary.missing_word,
)  # fmt: skip
"""The kinds of repairs, in the order in which they are tried."""
