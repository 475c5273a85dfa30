"""What the tests of this folder share."""

import pytest
import serial
from driver import Driver


@pytest.fixture
def driver(tmcm343):
    """The driver on a fresh module; its pauses are the module's time, so no test waits."""
    with serial.serial_for_url(tmcm343.serial_url, timeout=0.2) as port:
        yield Driver(port, sleep=tmcm343.run)
