"""Encoder discs."""

from tmcm34x.world.motor import Motor
from tmcm34x.world.shaft import Encoder


def test_a_turn_of_the_rotor_gives_four_edges_a_line():
    place = [0]
    encoder = Encoder(lambda: place[0], Motor(), 500)
    place[0] = 12800
    assert encoder.edges() == 2000
    place[0] = -12800
    assert encoder.edges() == -2000
    place[0] = -1
    assert encoder.edges() == -1


def test_slip_shortens_the_discs_way():
    place = [12800 * 100]
    assert Encoder(lambda: place[0], Motor(), 500, slip=0.01).edges() == 198_000
