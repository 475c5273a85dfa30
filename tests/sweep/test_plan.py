"""The rows of a sweep."""

import pytest

from tmcm34x.sweep.description import SweepError, parse
from tmcm34x.sweep.plan import rows

HEAD = 'program = "p.tmc"\nuntil_s = 1\n'
TAIL = '[figures]\nt = "time_us"\n'


def planned(*values, sampling=""):
    varied = "".join(f'[[vary]]\nwhat = "V{n}"\nvalues = {value}\n' for n, value in enumerate(values))
    return rows(parse(HEAD + varied + TAIL + sampling))


def sampling(kind, count, seed=0):
    return f'[sampling]\nkind = "{kind}"\ncount = {count}\nseed = {seed}\n'


def test_ranges_have_both_ends_and_stay_whole():
    assert planned("{ low = 1, high = 8, count = 4 }") == [(1,), (3,), (6,), (8,)]
    assert planned("{ low = 0.0, high = 1.0, count = 3 }") == [(0.0,), (0.5,), (1.0,)]
    assert planned("{ low = 5, high = 9, count = 1 }") == [(5,)]


@pytest.mark.parametrize("kind", ["random", "latin_hypercube"])
def test_sampling_is_of_the_seed_alone_and_within_the_values(kind):
    values = "{ low = 10, high = 19 }", "{ low = -1.0, high = 1.0 }", "[3, 5]"
    found = planned(*values, sampling=sampling(kind, 200, 7))
    assert found == planned(*values, sampling=sampling(kind, 200, 7))
    assert found != planned(*values, sampling=sampling(kind, 200, 8))
    assert len(found) == 200
    assert {row[0] for row in found} == set(range(10, 20))
    assert all(-1.0 <= row[1] <= 1.0 for row in found)
    assert {row[2] for row in found} == {3, 5}


def test_a_latin_hypercube_takes_each_part_of_each_range_once():
    found = planned(
        "{ low = 0.0, high = 50.0 }", "{ low = 0, high = 49 }", sampling=sampling("latin_hypercube", 50)
    )
    assert sorted(int(row[0]) for row in found) == list(range(50))
    assert sorted(row[1] for row in found) == list(range(50))
    assert [row[1] for row in found] != sorted(row[1] for row in found)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("{ low = 1, high = 9 }", "vary[0].values: without [sampling] a range has a count"),
        ("{ low = 9, high = 1, count = 2 }", "vary[0].values: low is greater than high"),
        ("[nan]", "vary[0].values: nan is not a number"),
    ],
)
def test_ranges_that_give_no_values(values, message):
    with pytest.raises(SweepError, match=message.replace("[", "\\[")):
        planned(values)


def test_too_many_rows():
    with pytest.raises(SweepError, match="vary: 1001000 rows are more than 1000000"):
        planned("{ low = 1, high = 1000, count = 1000 }", "{ low = 0, high = 1000, count = 1001 }")
