"""The ASCII interface of a real module, from the IDE."""

from ide.served import Bench
from tmcm34x.host import Connection
from tmcm34x.host.ascii import Terminal
from tmcm34x.tmcl.datagram import Instruction, pack_request


def test_a_telegram_that_was_on_its_way_does_not_spoil_the_first_line():
    bench = Bench()
    try:
        with Connection.open(f"tcp://{bench.address}") as connection:
            connection.ask(Instruction(139))
            connection.line.write(pack_request(1, Instruction(6, 1, 0)))
            terminal = Terminal()
            terminal.on = True
            assert terminal.send(connection, 1, "GAP 4, 0").endswith("BA 100 1000")
            assert terminal.send(connection, 1, "BIN").endswith("BA 100 0")
            assert not terminal.on
            assert connection.execute(Instruction(6, 4, 0)).value == 1000
    finally:
        bench.stop()
