from __future__ import annotations

import pytest

from firmware.hosts import Host, switched_on


def test_outputs_are_set_one_by_one_and_read_back():
    module = switched_on()
    host = Host(module)
    for port in range(8):
        host.do(f"SIO {port}, 2, 1")
        assert module.board.outputs == (2 << port) - 1
        assert host.do(f"GIO {port}, 2") == 1
    host.do("SIO 3, 2, 0")
    assert host.do("GIO 255, 2") == 0b1111_0111


def test_outputs_are_set_all_at_once():
    module = switched_on()
    host = Host(module)
    host.do("SIO 255, 2, 165")
    assert module.board.outputs == 165
    host.do("CALC LOAD, $1ff0f")
    host.do("SIO 255, 2, -1")
    assert module.board.outputs == 0x0F


@pytest.mark.parametrize("model", [341, 342, 343])
def test_inputs_are_read_digital_and_analogue(model):
    module = switched_on(model)
    host = Host(module)
    for port in range(8):
        module.board.set_analog(port, 100 * port + 100)
    assert [host.do(f"GIO {port}, 1") for port in range(8)] == [100 * port + 100 for port in range(8)]
    assert [host.do(f"GIO {port}, 0") for port in range(8)] == [0, 0, 0, 0, 0, 1, 1, 1]
    assert host.do("GIO 255, 0") == 0b1110_0000


def test_shutdown_is_port_10_and_no_part_of_all():
    module = switched_on()
    host = Host(module)
    module.board.set_shutdown(1)
    assert (host.do("GIO 10, 0"), host.do("GIO 255, 0")) == (1, 0)


class Device:
    def __init__(self):
        self.seen = []

    def exchange(self, data, nbytes):
        self.seen.append((data, nbytes))
        return 0xA1B2C3D4


def test_sac_reaches_the_three_select_lines():
    module = switched_on()
    host = Host(module)
    devices = [Device() for _ in range(3)]
    for select, device in enumerate(devices):
        module.board.attach_spi(select, device)
    host.do("CALC LOAD, 99")
    for select, bus in enumerate((0, 2, 3)):
        assert host.do(f"SAC {bus}, 4, -2") == 0xA1B2C3D4 - 2**32
        assert host.do(f"SAC {bus}, 3, -2") == 0xB2C3D4
        assert host.do(f"SAC {bus + 128}, 1, 5") == 0xD4
        assert devices[select].seen == [(0xFFFFFFFE, 4), (0xFFFFFE, 3), (99, 1)]


def test_an_open_line_reads_zeros():
    assert Host(switched_on()).do("SAC 0, 4, -1") == 0
