"""Programs put into the module by others: PyTrinamic's way and the TMCL-IDE's."""

import pytest
from pytrinamic.connections import ConnectionManager
from pytrinamic.tmcl import TMCLCommand, TMCLReplyStatusError

from tmcm34x.tmcl.datagram import Instruction, pack_record, unpack_record

PROGRAM = (
    Instruction(9, 7, 2, 0),  # SGP 7, 2, 0
    Instruction(10, 7, 2),  # Loop: GGP 7, 2
    Instruction(19, 0, 0, 1),  # CALC ADD, 1
    Instruction(35, 7, 2),  # AGP 7, 2
    Instruction(27, 0, 0, 1),  # WAIT TICKS, 0, 1
    Instruction(22, 0, 0, 1),  # JA Loop
)
END = Instruction(0)


@pytest.fixture(scope="module")
def served(serve_once):
    """One module on both links."""
    return serve_once("--pty", "--tcp", 0)


@pytest.fixture(params=["serial_tmcl", "socket_serial_tmcl"])
def interface(request, served):
    """A PyTrinamic connection to a module whose program is stopped."""
    port = served.pty if request.param == "serial_tmcl" else served.tcp
    with ConnectionManager(f"--interface {request.param} --port {port} --timeout 60").connect() as connection:
        connection.send(TMCLCommand.STOP_APPLICATION, 0, 0, 0)
        yield connection


def download(interface, program):
    """132, one telegram an instruction, 133: what PyTrinamic's LoadTMCLBinary.py does with an image file."""
    image = b"".join(map(pack_record, program))
    interface.send(TMCLCommand.START_DOWNLOAD_MODE, 0, 0, 0)
    for offset in range(0, len(image), 8):
        assert interface.send(*unpack_record(image[offset : offset + 8])).status == 101
    interface.send(TMCLCommand.QUIT_DOWNLOAD_MODE, 0, 0, 0)


def read_back(interface, size):
    found = []
    for address in range(size):
        reply = interface.send(TMCLCommand.READ_TMCL_MEMORY, 0, 0, address)
        data = reply.to_buffer()
        number, type_, motor = data[1:4]
        found.append(Instruction(number, type_, motor, int.from_bytes(data[4:8], "big", signed=True)))
    return tuple(found)


def counts(interface, wait_for):
    before = interface.get_global_parameter(7, 2)
    return wait_for(lambda: interface.get_global_parameter(7, 2) > before)


def test_the_way_of_pytrinamic(interface, wait_for):
    download(interface, PROGRAM)
    interface.send(TMCLCommand.RESET_APPLICATION, 0, 0, 0)
    interface.send(TMCLCommand.RUN_APPLICATION, 0, 0, 0)
    assert counts(interface, wait_for)
    assert read_back(interface, len(PROGRAM)) == PROGRAM


def test_the_way_of_the_tmcl_ide(interface, wait_for):
    """Its last telegram before 133 is all zero and marks the end; it starts with 128, 131, 129."""
    interface.send(TMCLCommand.STOP_APPLICATION, 0, 0, 0)
    download(interface, (*PROGRAM, END))
    interface.send(TMCLCommand.STOP_APPLICATION, 0, 0, 0)
    interface.send(TMCLCommand.RESET_APPLICATION, 0, 0, 0)
    interface.send(TMCLCommand.RUN_APPLICATION, 0, 0, 0)
    assert counts(interface, wait_for)
    interface.send(TMCLCommand.STOP_APPLICATION, 0, 0, 0)
    assert interface.send(TMCLCommand.GET_APPLICATION_STATUS, 0, 0, 0).value == 0
    assert read_back(interface, len(PROGRAM) + 1) == (*PROGRAM, END)


def test_a_full_memory_takes_no_more(interface):
    download(interface, [Instruction(19, 0, 0, n) for n in range(2048)])
    assert read_back(interface, 3) == tuple(Instruction(19, 0, 0, n) for n in range(3))
    with pytest.raises(TMCLReplyStatusError):
        download(interface, PROGRAM * 342)
    interface.send(TMCLCommand.QUIT_DOWNLOAD_MODE, 0, 0, 0)
