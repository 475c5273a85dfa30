"""The vendor's host library, PyTrinamic, under test."""

import pytest

pytest.importorskip("pytrinamic")

from pytrinamic.connections import ConnectionManager
from pytrinamic.tmcl import TMCLReplyChecksumError, TMCLReplyStatusError


@pytest.fixture
def interface(tmcm343):
    options = f"--interface socket_serial_tmcl --port {tmcm343.address}"
    with ConnectionManager(options).connect() as interface:
        yield interface


def test_it_moves(interface, tmcm343):
    interface.move_to(0, 51200)
    while not interface.get_axis_parameter(8, 0):
        pass
    assert tmcm343.motor(0).position == 51200


def test_it_raises_on_a_refusal(interface):
    with pytest.raises(TMCLReplyStatusError):
        interface.set_axis_parameter(4, 0, 5000)


def test_it_does_not_ask_again_after_a_damaged_reply(interface, tmcm343):
    tmcm343.fault("bad_checksum", count=1)
    with pytest.raises(TMCLReplyChecksumError):
        interface.get_axis_parameter(4, 0)
