from __future__ import annotations

from firmware.hosts import switched_on
from tmcm34x.firmware import encoder


class Recorder:
    """A device that answers with a position of its own."""

    def __init__(self, position):
        self.position = position
        self.seen = []

    def exchange(self, data, nbytes):
        self.seen.append((f"{data:08x}", nbytes))
        return 0xF000_0000 | self.position


def test_without_an_interface_nothing_is_sent():
    module = switched_on()
    device = Recorder(5)
    module.board.attach_spi(0, device)
    encoder.configure(module, 0, 512)
    assert (encoder.position(module, 0), device.seen) == (0, [])


def test_positions_are_signed_and_flags_are_dropped():
    module = switched_on()
    module.board.attach_spi(2, Recorder(0xFFFFFE))
    module.encoder_interface = 3
    assert [encoder.position(module, motor) for motor in range(3)] == [-2, -2, -2]


def test_datagrams_are_those_of_the_chip():
    module = switched_on()
    device = Recorder(0)
    module.board.attach_spi(0, device)
    module.encoder_interface = 1
    for motor in range(3):
        encoder.position(module, motor)
        encoder.preload(module, motor, -1)
        encoder.configure(module, motor, 512 | 8)
    assert device.seen == [
        ("08000000", 4), ("09ffffff", 4), ("01010400", 4),
        ("0a000000", 4), ("0bffffff", 4), ("03010400", 4),
        ("0c000000", 4), ("0dffffff", 4), ("05010400", 4),
    ]  # fmt: skip
