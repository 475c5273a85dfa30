"""Values: what parts remember, and the bytes that stand for it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tmcm34x.clock import digest, pack, unpack

values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text()
    | st.binary(max_size=40),
    lambda inner: st.lists(inner, max_size=5).map(tuple),
    max_leaves=20,
)


def kinds(value):
    """A value with the type of everything in it: 1, 1.0 and True are three things."""
    return (
        (tuple, [kinds(item) for item in value]) if isinstance(value, tuple) else (type(value), repr(value))
    )


@given(values)
def test_a_value_comes_back_as_it_was(value):
    assert kinds(unpack(pack(value))) == kinds(value)
    assert pack(unpack(pack(value))) == pack(value)


@given(values, values)
def test_different_values_have_different_bytes_and_digests(one, other):
    same = kinds(one) == kinds(other)
    assert (pack(one) == pack(other)) == same
    assert (digest(one) == digest(other)) == same


def test_infinity_and_the_sign_of_zero_survive():
    inf, zero = unpack(pack((math.inf, -0.0)))
    assert inf == math.inf
    assert math.copysign(1, zero) == -1


@pytest.mark.parametrize("foreign", [object(), {1}, bytearray(b"x"), 1j])
def test_what_is_no_state_is_refused(foreign):
    with pytest.raises(TypeError, match="is no state"):
        pack((foreign,))


@given(st.binary(max_size=60))
def test_foreign_bytes_are_a_value_error_or_a_value(data):
    try:
        value = unpack(data)
    except ValueError:
        return
    assert kinds(unpack(pack(value))) == kinds(value)


@pytest.mark.parametrize("data", [b"", b"[1", b"\xff", b"{}", b'{"":1}', b'{"":"*"}', b"[" * 100_000])
def test_bytes_that_stand_for_no_value_are_refused(data):
    with pytest.raises(ValueError):
        unpack(data)
