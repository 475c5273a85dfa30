"""Hosts on lines of a server that keeps a history, at clocks of the test's own."""

from tmcm34x.bench import simple_rig
from tmcm34x.clock import HZ
from tmcm34x.debug.history import History
from tmcm34x.server import Server


class Hosts:
    """A server with `count` serial lines; `send` lets time pass first."""

    def __init__(self, count):
        self.wall_s = 0.0
        self.server = Server(simple_rig(), monotonic=lambda: self.wall_s)
        self.history = self.server.part = self.server.recorder = History(self.server.rig)
        self.replies = []
        self.lines = [self.server.connect(f"host {n}", self.replies.append) for n in range(count)]

    def wait(self, clocks):
        """Let time pass."""
        self.wall_s += clocks / HZ
        while not self.server.catch_up():
            pass
        self.server.settle()

    def send(self, line, data, clocks):
        """Let time pass, and send bytes on a line."""
        self.wall_s += clocks / HZ
        while not self.server.catch_up():
            pass
        self.lines[line].receive(data)
