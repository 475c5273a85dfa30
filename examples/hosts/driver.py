"""A small driver of one's own, over pyserial: what the tests beside it test.

It repeats a request whose reply was damaged, raises on a refusal, and waits for a move by asking the module.
"""

import time

OK = 100
ROR, MST, MVP, SAP, GAP, RFS = 1, 3, 4, 5, 6, 13
ACTUAL_POSITION, MAX_SPEED, POSITION_REACHED = 1, 4, 8


class RefusedError(Exception):
    """The module answered with an error status."""


class NoReplyError(Exception):
    """The module did not answer, or only with damaged telegrams."""


class Driver:
    """A TMCM-34x at `port`, an open pyserial port with a time-out."""

    def __init__(self, port, address=1, retries=2, sleep=time.sleep):
        self.port = port
        self.address = address
        self.retries = retries
        self.sleep = sleep

    def command(self, number, type_=0, motor=0, value=0):
        """Have a command executed; returns the value of the reply."""
        body = bytes((self.address, number, type_, motor)) + value.to_bytes(4, "big", signed=True)
        request = body + bytes((sum(body) % 256,))
        for _ in range(1 + self.retries):
            self.port.reset_input_buffer()
            self.port.write(request)
            reply = self.port.read(9)
            if len(reply) == 9 and sum(reply[:8]) % 256 == reply[8] and reply[3] == number:
                if reply[2] != OK:
                    raise RefusedError(f"command {number}: status {reply[2]}")
                return int.from_bytes(reply[4:8], "big", signed=True)
        raise NoReplyError(f"command {number}")

    def position(self, motor):
        """The actual position [microsteps]."""
        return self.command(GAP, ACTUAL_POSITION, motor)

    def set_max_speed(self, motor, speed):
        """The speed of moves [velocity units]."""
        self.command(SAP, MAX_SPEED, motor, speed)

    def move_to(self, motor, position, timeout=30.0):
        """Move to a position and wait until the motor is there."""
        self.command(MVP, 0, motor, position)
        self.wait(lambda: self.command(GAP, POSITION_REACHED, motor), timeout)

    def home(self, motor, timeout=30.0):
        """Look for the reference point; gives up, and stops the motor, when it is not found in time."""
        self.command(RFS, 0, motor)
        try:
            self.wait(lambda: self.command(RFS, 2, motor) == 0, timeout)
        except TimeoutError:
            self.command(RFS, 1, motor)
            self.command(MST, 0, motor)
            raise

    def wait(self, done, timeout):
        """Ask every 20 ms until `done`."""
        for _ in range(round(timeout / 0.02)):
            if done():
                return
            self.sleep(0.02)
        raise TimeoutError(f"not done within {timeout} s")
