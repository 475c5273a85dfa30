"""What hangs on a module is saved and loaded: rotors, switches that bounce, inputs that are held, devices, encoders."""

from bench.rigs import rig_of, run_ms, run_while, say
from tmcm34x.bench.action import Action
from tmcm34x.clock import HZ, NEVER, pack, unpack

BENCH = """
[[module]]
spi = { SPI_SEL0 = { kind = "tmcm323" }, SPI_SEL1 = { kind = "shift_register", bytes = 2 } }

[module.input]
IN_0 = { kind = "square", period_ms = 130 }

[[module.axis]]
load = { kind = "carriage", low = 0, high = 100, start = 50, force = 3.0 }
encoder = { lines = 800, slip = 0.1 }
switch.left = { position = 0, hysteresis = 0.1 }
switch.right = { position = 50.4 }
switch.bounce_ms = 2
"""


def through_bytes(value):
    return unpack(pack(value))


def disturbed():
    """A bench in the middle of everything: a bouncing contact, a fault, a held input, a device with state."""
    rig = rig_of(BENCH)
    for line in ("ROR 0, 900", "SAC 2, 2, 4660", "SGP 74, 0, 1"):
        say(rig, line)
    rig.act(Action("level", 0, (0, 700)))
    rig.act(Action("level", 0, (8, 0)))
    rig.act(Action("fault", 0, (1, "open_load_a", True)))
    rig.act(Action("push", 0, (0, 0.01)))
    rig.act(Action("unplug", 0, (2, "left", True)))
    line = rig.worlds[0].mounts[0].axis.right
    run_while(rig, lambda: line.next_event(rig.now) == NEVER, limit_ms=2000)
    return rig


def test_a_world_that_was_saved_is_the_same_world():
    rig, other = disturbed(), rig_of(BENCH)
    saved = rig.worlds[0].save()
    assert saved != other.worlds[0].save()
    other.worlds[0].load(through_bytes(saved))
    other.modules[0].board.load(through_bytes(rig.modules[0].board.save()))
    assert other.worlds[0].save() == saved
    assert other.modules[0].board.digest() == rig.modules[0].board.digest()
    assert other.worlds[0].view() == rig.worlds[0].view()
    assert other.worlds[0].overridden == rig.worlds[0].overridden == [0]
    assert other.worlds[0].level(0) == 700
    assert other.modules[0].board.spi_exchange(1, 0, 2) == 4660


def test_saving_does_nothing():
    rig, twin = disturbed(), disturbed()
    for _ in range(20):
        rig.worlds[0].save()
        for each in (rig, twin):
            each.advance(min(each.next_event(), each.now + HZ))
    assert rig.worlds[0].save() == twin.worlds[0].save()
    assert rig.modules[0].board.save() == twin.modules[0].board.save()


def test_a_device_put_on_the_bus_later_is_saved_and_one_taken_away_stays_away():
    rig, other = rig_of(BENCH), rig_of(BENCH)
    rig.act(Action("spi", 0, (1, "constant", 77)))
    rig.act(Action("spi", 0, (2, "previous", 0)))
    assert rig.modules[0].board.spi_exchange(2, 5, 1) == 0
    rig.modules[0].board.attach_spi(0, None)
    other.worlds[0].load(through_bytes(rig.worlds[0].save()))
    board = other.modules[0].board
    assert board.spi_device(0) is None
    assert board.spi_exchange(1, 0, 1) == 77
    assert board.spi_exchange(2, 0, 1) == 5


def test_an_input_that_was_given_back_is_free_again():
    rig, other = rig_of(BENCH), rig_of(BENCH)
    other.act(Action("level", 0, (0, 3)))
    other.worlds[0].load(through_bytes(rig.worlds[0].save()))
    assert other.worlds[0].overridden == []
    run_ms(other, 70)
    run_ms(rig, 70)
    assert other.worlds[0].level(0) == rig.worlds[0].level(0)
