"""The boot loader: entering, writing an image, refusing a wrong one, starting."""

import time

import pytest
from intelhex import IntelHex
from pytrinamic.cli.tmclfwupload import firmware_update
from pytrinamic.connections.tmcl_interface import TmclInterface
from pytrinamic.tmcl import TMCLReplyStatusError

from firmware.hosts import Host, switched_on
from firmware.programs import program_of
from tmcm34x.firmware.boot import COMMANDS, PAGE, SIZE, START, BootLoader
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl.commands import BOOT_KEY
from tmcm34x.tmcl.datagram import Instruction, pack_request

OK, WRONG_TYPE, INVALID_COMMAND, INVALID_VALUE, NOT_AVAILABLE = 100, 3, 2, 4, 6
IMAGE = b"some code " * 300 + b"343V4.40" + bytes(range(256)) * 2


class BootHost(Host):
    def __init__(self, model=343, **options):
        module = switched_on(model, **options)
        self.loader = BootLoader(module)
        super().__init__(module)

    def enter(self):
        self.send(242, *BOOT_KEY)
        assert self.received == []
        assert self.loader.active

    def call(self, number, type_=0, motor=0, value=0):
        self.send(number, type_, motor, value)
        (reply,) = self.replies()
        assert reply.command == number
        return reply.status, reply.value

    def version(self):
        self.send(136)
        return self.received.pop()[1:].decode()

    def upload(self, image=IMAGE, length=None, checksum=None):
        """Status of the last command."""
        self.call(200)
        image = image + bytes(-len(image) % 4)
        for page in range(0, len(image), PAGE):
            part = image[page : page + PAGE]
            for offset in range(0, len(part), 4):
                word = int.from_bytes(part[offset : offset + 4], "little", signed=True)
                assert self.call(201, offset // 4 % 256, offset // 4 // 256, word) == (OK, word)
            assert self.call(202, value=START + page)[0] == OK
        self.call(208, 0, 0, len(image) if length is None else length)
        return self.call(208, 1, 0, sum(image) if checksum is None else checksum)[0]


@pytest.mark.parametrize("model", [341, 342, 343])
def test_the_key_leads_from_the_firmware_to_the_boot_loader_and_205_back(model):
    host = BootHost(model)
    assert host.version() == f"{model}V4.36"
    host.enter()
    assert host.version() == f"{model}B1.00"
    assert host.call(136, 1) == (OK, model << 16 | 0x100)
    host.send(205)
    assert host.received == []
    assert host.version() == f"{model}V4.36"
    assert not host.loader.active


def test_another_key_is_an_unknown_command_in_both():
    host = BootHost()
    assert host.call(242, *BOOT_KEY[:2], 5)[0] == INVALID_COMMAND
    host.enter()
    assert host.call(242, *BOOT_KEY[:2], 5)[0] == INVALID_COMMAND
    host.enter()


def test_the_boot_loader_knows_its_own_commands_only_and_stops_everything():
    host = BootHost()
    host.do("ROR 0, 500")
    host.wait_ms(500)
    host.enter()
    known = {row.number for row in COMMANDS} | {136, 242}
    for number in set(range(256)) - known:
        assert host.call(number)[0] == INVALID_COMMAND
    assert not host.module.program.state
    assert host.module.board.currents == [0, 0, 0]
    assert host.module.board.chips[0].velocity(0) == 0


def test_information_and_memory_have_their_ranges():
    host = BootHost()
    host.enter()
    assert [host.call(206, n) for n in range(4)] == [(OK, PAGE), (OK, START), (OK, SIZE), (WRONG_TYPE, 0)]
    assert host.call(202, value=START)[0] == NOT_AVAILABLE, "not erased"
    assert host.call(204, value=START) == (OK, -1)
    host.call(200)
    assert host.call(201, 0, PAGE // 1024)[0] == INVALID_VALUE
    assert host.call(201, 1, 0, 0x01020304) == (OK, 0x01020304)
    assert host.call(202, value=START + PAGE)[0] == OK
    assert host.call(204, value=START + PAGE + 4) == (OK, 0x01020304)
    assert host.call(204, value=START + PAGE + 5) == (OK, -0xFEFDFD)
    for address in (0, START - PAGE, START + 1, START + SIZE):
        assert host.call(202, value=address)[0] == INVALID_VALUE
    for address in (START - 1, START + SIZE):
        assert host.call(203, value=address)[0] == INVALID_VALUE
        assert host.call(204, value=address)[0] == INVALID_VALUE
    assert host.call(203, value=START + 3) == (OK, 4 * 255)
    assert host.call(208, 2)[0] == WRONG_TYPE
    assert host.call(208, 0, 0, SIZE + 1)[0] == INVALID_VALUE


def test_an_image_is_written_verified_and_started_and_the_program_survives():
    host = BootHost()
    program = program_of("ROR 0, 100 \n STOP")
    host.module.eeprom.write_program(program)
    host.do("SGP 77, 0, 1")
    host.enter()
    assert host.upload() == OK
    assert host.call(203, value=START + len(IMAGE) - 1) == (OK, sum(IMAGE))
    host.send(205)
    assert host.version() == "343V4.36"
    host.wait_ms(500)
    assert host.do("GAP 2, 0") == 100, "auto start runs the program that was there"


@pytest.mark.parametrize(
    ("image", "length", "checksum"),
    [
        (IMAGE.replace(b"343V", b"341V"), None, None),
        (IMAGE.replace(b"343V4.40", b"no name "), None, None),
        (IMAGE, None, 1),
        (IMAGE, len(IMAGE) - 500, None),
        (IMAGE, 0, None),
    ],
)
def test_an_image_that_does_not_fit_is_refused_and_not_started(image, length, checksum):
    host = BootHost()
    host.enter()
    assert host.upload(image, length, checksum) == INVALID_VALUE
    host.send(205)
    assert host.version() == "343B1.00"
    assert host.upload() == OK
    host.send(205)
    assert host.version() == "343V4.36"


def test_power_lost_while_writing_leaves_the_module_in_the_boot_loader():
    host = BootHost()
    host.enter()
    host.call(200)
    host.module.reset()
    assert host.version() == "343B1.00"
    assert host.upload() == OK
    host.module.reset()
    assert host.version() == "343V4.36"


def test_power_lost_before_erasing_starts_the_firmware_again():
    host = BootHost()
    host.enter()
    host.module.reset()
    assert host.version() == "343V4.36"


def test_lines_of_text_end_with_the_firmware():
    host = BootHost()
    host.send(139)
    host.received.clear()
    other = Host(host.module)
    assert host.port.ascii_mode
    other.send(242, *BOOT_KEY)
    assert not host.port.ascii_mode
    assert host.version() == "343B1.00"


# The vendor's own tool


class InProcess(TmclInterface):
    def __init__(self, module):
        super().__init__(2, 1)
        self.replies = []
        self.port = SerialPort(module, self.replies.append)

    def close(self):
        pass

    def _send(self, host_id, module_id, data):
        del host_id, module_id
        self.port.receive(bytes(data))

    def _recv(self, host_id, module_id):
        del host_id, module_id
        return self.replies.pop(0)


def hex_file(path, image):
    file = IntelHex()
    file.frombytes(image, START)
    file.write_hex_file(str(path))
    return str(path)


@pytest.fixture
def quick(monkeypatch):
    """The tool waits a second for the boot loader; virtual time needs no waiting."""
    monkeypatch.setattr(time, "sleep", lambda _: None)


@pytest.mark.usefixtures("quick")
def test_the_vendors_update_tool_writes_an_image_and_starts_it(tmp_path, capsys):
    host = BootHost()
    assert firmware_update(InProcess(host.module), hex_file(tmp_path / "image.hex", IMAGE)) in (None, 0)
    assert "Checksum of the uploaded firmware matches" in capsys.readouterr().out
    assert host.version() == "343V4.36"
    assert not host.loader.active


@pytest.mark.usefixtures("quick")
def test_the_vendors_update_tool_refuses_an_image_of_another_module(tmp_path, capsys):
    host = BootHost()
    path = hex_file(tmp_path / "image.hex", IMAGE.replace(b"343V", b"341V"))
    assert firmware_update(InProcess(host.module), path) == 1
    assert "No matching version string" in capsys.readouterr().out


def test_a_tool_that_does_not_look_is_told_by_the_status():
    host = BootHost()
    host.enter()
    interface = InProcess(host.module)
    interface.send(200, 0, 0, 0)
    interface.send(208, 0, 0, 100)
    with pytest.raises(TMCLReplyStatusError):
        interface.send(208, 1, 0, 0)


def test_the_boot_loader_keeps_the_modules_address():
    host = BootHost(address=9)
    host.address = 9
    host.enter()
    assert host.version() == "343B1.00"
    host.port.receive(pack_request(1, Instruction(136)))
    assert host.received == []
