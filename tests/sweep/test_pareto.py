"""The Pareto front."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tmcm34x.sweep.description import SweepError, parse
from tmcm34x.sweep.pareto import front

POINTS = st.lists(st.fixed_dictionaries({"a": st.integers(0, 9), "b": st.integers(0, 9)}), max_size=30)


def beats(one, other):
    """Whether `one` is at least as good in both, and better in one: low a, high b."""
    return one["a"] <= other["a"] and one["b"] >= other["b"] and one != other


@given(POINTS)
def test_no_row_of_the_front_is_beaten_and_every_other_is_beaten_or_equal_to_one(rows):
    places = front(rows, {"a": "low", "b": "high"})
    best = [rows[place] for place in places]
    assert [row["a"] for row in best] == sorted(row["a"] for row in best)
    for row in rows:
        assert (row in best) == (not any(beats(other, row) for other in rows))
    assert len({(row["a"], row["b"]) for row in best}) == len(best)


@pytest.mark.parametrize(
    ("pareto", "message"),
    [
        ('d = "low"', "pareto: a front is between two columns"),
        ('d = "low"\nx = "high"', "pareto.x: there is no column of this name"),
        ('d = "low"\nrow = "high"', "pareto.row: there is no column of this name"),
        ('d = "low"\ne = "most"', "pareto"),
    ],
)
def test_mistakes(pareto, message):
    text = 'program = "p"\nuntil_s = 1\n[[vary]]\nwhat = "e"\nvalues = [0]\n[figures]\nd = "1"\n[pareto]\n'
    with pytest.raises(SweepError, match=message):
        parse(text + pareto)
