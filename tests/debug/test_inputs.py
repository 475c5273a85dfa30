"""Inputs in columns are the inputs that were added."""

from hypothesis import given
from hypothesis import strategies as st

from tmcm34x.debug.inputs import INPUT_SIZE, Input, Inputs, size

TELEGRAMS = st.tuples(st.binary(max_size=12), st.booleans(), st.sampled_from([None, None, 9600]))
FRAMES = st.tuples(st.integers(0, 2000), st.binary(max_size=8), st.none())
INPUTS = st.one_of(
    st.builds(Input, st.integers(0, 1 << 60), st.just("received"), st.integers(1, 300), TELEGRAMS | FRAMES),
    st.builds(
        Input,
        st.integers(0, 1 << 60),
        st.just("action"),
        st.integers(0, 3),
        st.tuples(st.just("power"), st.booleans()),
    ),
)


def kept(items):
    inputs = Inputs()
    for item in items:
        inputs.append(item)
    return inputs


@given(st.lists(INPUTS), st.integers(0, 9), st.integers(0, 9))
def test_inputs_come_out_as_they_went_in(items, start, end):
    inputs = kept(items)
    assert list(inputs) == items and len(inputs) == len(items)
    assert [inputs[n] for n in range(len(items))] == items
    assert list(inputs[start:end]) == items[start:end]
    assert list(inputs.received) == [item.clock for item in items if item.kind == "received"]
    assert list(inputs.others) == [item for item in items if item.kind != "received"]
    inputs.forget(start)
    assert list(inputs) == items[start:]


def test_a_telegram_takes_less_memory_than_anything_else_and_long_pieces_are_counted():
    telegram = Input(5, "received", 1, (bytes(9), False, None))
    assert size(kept([telegram]).contents) < INPUT_SIZE < size(kept([Input(5, "plugged", 1, ())]).contents)
    longer = telegram._replace(values=(bytes(4096), False, None))
    assert size(kept([longer]).contents) - size(kept([telegram]).contents) == 4096 - 9
