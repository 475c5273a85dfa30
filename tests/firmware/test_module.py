from __future__ import annotations

import pytest

from firmware.hosts import Host, module_state, switched_on
from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.chips.registers import FIELDS, read_ram
from tmcm34x.clock import HZ, MS, NEVER, run_until
from tmcm34x.firmware.boot import BootLoader
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom, EepromError
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import BOOT_KEY
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction


@pytest.mark.parametrize("model", MODELS)
def test_a_fresh_module_has_the_factory_defaults(model):
    host = Host(switched_on(model))
    for row in AXIS_PARAMETERS:
        for motor in range(3):
            reply = host.ask(f"GAP {row.number}, {motor}")
            if model not in row.models:
                assert (reply.status, reply.value) == (3, 0)
            elif row.number == 8:
                assert reply.value == 1
            else:
                assert (reply.status, reply.value) == (100, row.default)


def test_power_on_loads_driver_chain_and_sine_table_into_every_chip():
    for model in MODELS.values():
        module = switched_on(model.number)
        table = module.eeprom.driver_chain + module.eeprom.microstep_table
        for chip in range(len(model.parts)):
            cells = bytearray()
            for address in range(64):
                data = module.board.transfer(chip, read_ram(address))
                cells += bytes((data & 63, data >> 8 & 63))
            assert cells == table
            smgp = FIELDS["LSMD"][0]
            assert module.board.transfer(chip, smgp.read()) & smgp.writable == model.smgp


def test_a_module_switched_off_does_not_answer_or_move():
    module = switched_on()
    host = Host(module)
    host.do("ROR 0, 500")
    host.do("SIO 3, 2, 1")
    host.wait_ms(500)
    module.power_off()
    position = module.axes[0].at_target
    host.send(6, 1, 0)
    host.wait_ms(1000)
    assert host.replies() == []
    assert module.next_event() == NEVER
    assert module.board.outputs == 0
    assert position
    module.power_on()
    assert host.do("GAP 1, 0") == 0


def test_reset_keeps_only_what_is_stored():
    module = switched_on()
    host = Host(module)
    for line in (
        "SAP 4, 0, 321",
        "STAP 4, 0",
        "SAP 4, 1, 555",
        "SGP 3, 2, 77",
        "STGP 3, 2",
        "SGP 4, 2, 88",
        "SCO 1, 0, 5",
    ):
        host.do(line)
    module.reset()
    assert [host.do(f"GAP 4, {motor}") for motor in range(3)] == [321, 1000, 1000]
    assert [host.do(f"GGP {n}, 2") for n in (3, 4)] == [77, 0]
    assert host.do("GCO 1, 0") == 0


def test_user_variables_stay_cleared_when_parameter_85_says_so():
    module = switched_on()
    host = Host(module)
    for line in ("SGP 3, 2, 77", "STGP 3, 2", "SGP 85, 0, 1"):
        host.do(line)
    module.reset()
    assert host.do("GGP 3, 2") == 0
    host.do("RSGP 3, 2")
    assert host.do("GGP 3, 2") == 77


def test_another_magic_restores_the_defaults_at_the_next_power_on():
    module = switched_on()
    host = Host(module)
    for line in ("SAP 4, 0, 321", "STAP 4, 0", "SGP 66, 0, 1", "SGP 77, 0, 1", "SGP 64, 0, 0"):
        host.do(line)
    assert host.do("GGP 77, 0") == 1
    module.reset()
    assert [host.do(line) for line in ("GAP 4, 0", "GGP 77, 0", "GGP 64, 0")] == [1000, 0, 0xE4]


def test_restoring_the_factory_settings_has_no_reply_and_resets():
    module = switched_on()
    host = Host(module)
    for line in ("SAP 4, 0, 321", "STAP 4, 0", "ROR 1, 500", "132 0, 0, 0", "ROR 0, 1", "133 0, 0, 0"):
        host.send(*parse_instruction(line))
    host.replies()
    assert host.status("137 0, 0, 1233") == 4
    host.wait_ms(100)
    host.send(137, 0, 0, 1234)
    assert host.replies() == []
    assert host.do("GAP 4, 0") == 1000
    assert host.do("GAP 3, 1") == 0
    assert module.eeprom.read_instruction(0) == Instruction(1, 0, 0, 1)


def test_a_locked_eeprom_keeps_its_settings_against_137():
    host = Host(switched_on())
    host.do("SGP 77, 0, 1")
    host.do("SGP 73, 0, 1234")
    assert host.status("137 0, 0, 1234") == 5
    assert host.do("GGP 77, 0") == 1


@pytest.mark.parametrize(
    "line",
    [
        "STAP 4, 0",
        "SGP 77, 0, 1",
        "SGP 64, 0, 0",
        "AGP 77, 0",
        "STGP 0, 2",
        "STGP 7, 0",
        "STGP 23, 0",
        "SCO 0, 255",
        "SCO 3, 255",
    ],
)
def test_a_locked_eeprom_refuses_to_store(line):
    module = switched_on()
    host = Host(module)
    line += ", 0" * line.startswith("SCO")
    host.do("SGP 73, 0, 1234")
    before = module_state(module)
    assert host.status(line) == 5
    assert module_state(module) == before
    host.do("SGP 73, 0, 4321")
    host.do(line)


@pytest.mark.parametrize(
    "line",
    ["SAP 4, 0, 5", "SGP 3, 2, 5", "SGP 255, 0, 0", "RSAP 4, 0", "RSGP 0, 2", "SCO 3, 0, 5", "SGP 132, 0, 1"],
)
def test_a_locked_eeprom_leaves_ram_alone(line):
    host = Host(switched_on())
    host.do("SGP 73, 0, 1234")
    host.do(line)


def test_coordinates_in_the_eeprom_are_locked_with_it():
    host = Host(switched_on())
    for line in ("SGP 84, 0, 1", "SCO 3, 0, 700", "SGP 73, 0, 1234"):
        host.do(line)
    assert [host.status(line) for line in ("SCO 3, 0, 5", "CCO 3, 7", "ACO 3, 1", "SCO 0, 0, 5")] == [
        5,
        5,
        5,
        100,
    ]
    assert host.do("GCO 3, 0") == 700


def test_an_image_of_another_model_is_refused():
    with pytest.raises(EepromError, match="TMCM-341, not of a TMCM-343"):
        FirmwareModule(Board(MODELS[343]), Eeprom(341))


def test_addresses_given_at_the_start_are_stored():
    module = switched_on(address=7, host_address=9)
    host = Host(module, address=7)
    assert host.do("GGP 66, 0") == 7
    host.send(10, 76)
    assert [(reply.host, reply.address, reply.value) for reply in host.replies()] == [(9, 7, 9)]


# Command 138


def test_the_second_reply_of_138_comes_when_all_chosen_motors_have_arrived():
    module = switched_on()
    host = Host(module)
    host.do("MVP ABS, 0, 1000")
    host.do("MVP ABS, 2, 40000")
    host.send(138, 0, 0, 0b101)
    assert [(reply.status, reply.command, reply.value) for reply in host.replies()] == [(100, 138, 5)]
    while not host.received:
        assert module.next_event() != NEVER
        module.advance(module.next_event())
    assert [(reply.status, reply.command, reply.value) for reply in host.replies()] == [(128, 138, 5)]
    assert [host.do(f"GAP {number}, {motor}") for number, motor in ((8, 0), (8, 2), (1, 2))] == [1, 1, 40000]


def test_the_second_reply_of_138_follows_at_once_when_nothing_is_to_be_waited_for():
    host = Host(switched_on())
    host.send(138, 0, 0, 7)
    assert [reply.status for reply in host.replies()] == [100, 128]


def test_the_second_reply_of_138_goes_to_the_port_that_asked():
    module = switched_on()
    first, second = Host(module), Host(module)
    first.do("MVP ABS, 0, 1000")
    second.send(138, 0, 0, 1)
    second.replies()
    first.wait_ms(1000)
    assert first.replies() == []
    assert [reply.status for reply in second.replies()] == [128]


def test_a_motor_that_passes_its_target_has_not_reached_it():
    module = switched_on()
    host = Host(module)
    for line in ("SAP 4, 0, 1500", "ROR 0, 1500"):
        host.do(line)
    host.wait_ms(1500)
    target = host.do("GAP 1, 0") + 50
    module.eeprom.write_program([parse_instruction("WAIT POS, 0, 0"), parse_instruction("STOP")])
    host.do(f"MVP ABS, 0, {target}")
    host.do("129 0, 0, 0")
    host.send(138, 0, 0, 1)
    assert [reply.status for reply in host.replies()] == [100]
    host.wait_ms(50)
    assert host.do("GAP 1, 0") > target + 50
    assert module.program.waiting
    while module.program.waiting:
        module.advance(module.next_event())
    assert [(reply.status, reply.value) for reply in host.replies()] == [(128, 1)]
    assert [host.do(f"GAP {n}, 0") for n in (1, 8)] == [target, 1]
    assert abs(host.do("GAP 3, 0")) <= 1


def test_a_new_138_replaces_the_one_that_waits():
    host = Host(switched_on())
    host.do("MVP ABS, 0, 1000")
    host.send(138, 0, 0, 1)
    host.send(138, 0, 0, 3)
    host.replies()
    host.wait_ms(1000)
    assert [(reply.status, reply.value) for reply in host.replies()] == [(128, 3)]


def test_a_host_may_send_from_within_the_reply_it_gets():
    module = switched_on()
    received = []

    def answer(data):
        received.append(data[2:4])
        if data[2] == 128 and len(received) < 20:
            port.receive(pack_request(1, Instruction(4, 1, 0, 500)))
            port.receive(pack_request(1, Instruction(138, 0, 0, 1)))

    port = SerialPort(module, answer)
    port.receive(pack_request(1, Instruction(138, 0, 0, 1)))
    run_until(module, 10 * HZ)
    assert received == [
        bytes((100, 138)),
        *[bytes((128, 138)), bytes((100, 4)), bytes((100, 138))] * 6,
        bytes((128, 138)),
    ]


def test_138_without_a_mask_of_motors_is_refused():
    host = Host(switched_on())
    assert host.status("138 0, 0, 8") == 4
    assert host.status("138 0, 0, -1") == 4


def test_setting_the_position_to_the_target_counts_as_arrival():
    host = Host(switched_on())
    host.do("ROR 0, 0")
    host.do("SAP 0, 0, 500")
    host.send(138, 0, 0, 1)
    assert len(host.replies()) == 1
    host.send(5, 1, 0, 500)
    assert [reply.status for reply in host.replies()] == [100, 128]


# Version, boot loader, user functions


def test_command_242_is_unknown_without_a_boot_loader():
    host = Host(switched_on())
    type_, motor, value = BOOT_KEY
    host.send(242, type_, motor, value)
    assert [reply.status for reply in host.replies()] == [2]


def test_command_242_with_its_key_calls_the_boot_loader_without_reply():
    module = switched_on()
    host = Host(module)
    boot = BootLoader(module)
    type_, motor, value = BOOT_KEY
    host.send(242, type_, motor, value)
    assert (boot.active, host.replies()) == (True, [])
    host.send(242, type_, motor, value + 1)
    assert [reply.status for reply in host.replies()] == [2]


def test_user_functions_can_be_supplied():
    module = switched_on()
    host = Host(module)
    assert host.ask("UF3 1, 2, 3").status == 6
    module.user_functions[3] = lambda _, type_, motor, value: (100, type_ * 100 + motor * 10 + value)
    assert host.do("UF3 1, 2, 3") == 123


def test_bank_1_has_what_an_extension_puts_there():
    module = switched_on()
    host = Host(module)
    assert host.ask("SGP 7, 1, 5").status == host.ask("GGP 7, 1").status == 4
    module.user_parameters[7] = 11
    assert host.do("GGP 7, 1") == 11
    before = module.eeprom.revision
    host.do("SGP 7, 1, -5")
    assert module.user_parameters == {7: -5}
    assert module.eeprom.revision == before
    assert host.ask("GGP 8, 1").status == host.ask("SGP 8, 1, 0").status == 3
    assert host.ask("GGP 7, 3").status == 4


# Ports


def test_several_ports_are_answered_separately():
    module = switched_on()
    hosts = [Host(module) for _ in range(3)]
    for n, host in enumerate(hosts):
        host.send(5, 4, n, 100 + n)
    assert [[reply.value for reply in host.replies()] for host in hosts] == [[100], [101], [102]]


def test_a_usb_port_takes_any_address():
    module = switched_on()
    received = []
    port = SerialPort(module, received.append, any_address=True)
    for address in (0, 1, 77, 255):
        port.receive(pack_request(address, Instruction(6, 4, 0)))
    assert len(received) == 4
    assert {reply[1] for reply in received} == {1}


# Time


def test_a_module_at_rest_has_nothing_to_do():
    module = switched_on()
    assert module.next_event() == NEVER
    host = Host(module)
    host.do("MVP ABS, 0, 1000")
    run_until(module, 5 * HZ)
    assert module.next_event() == NEVER
    before = module_state(module)
    run_until(module, 3605 * HZ)
    assert module_state(module)[1:] == before[1:]


def test_the_tick_timer_counts_milliseconds():
    module = switched_on()
    host = Host(module)
    host.wait_ms(1234)
    assert host.do("GGP 132, 0") == 1234
    host.do("SGP 132, 0, -10")
    host.wait_ms(25)
    assert host.do("GGP 132, 0") == 15
    host.do("SGP 132, 0, 2147483647")
    host.wait_ms(1)
    assert host.do("GGP 132, 0") == -(2**31)


def test_random_numbers_follow_from_the_seed():
    def numbers(seed):
        host = Host(switched_on(seed=seed))
        return [host.do("GGP 133, 0") for _ in range(200)]

    first = numbers(1)
    assert first == numbers(1) != numbers(2)
    assert len(set(first)) == 200
    assert all(0 <= number < 2**31 for number in first)
    assert 60 < sum(number < 2**30 for number in first) < 140


def test_an_observer_sees_telegrams_and_events():
    class Recorder:
        def __init__(self):
            self.seen = []

        def telegram(self, port, direction, data, now):
            self.seen.append((direction, data.hex(), now))

        def instruction(self, address, instruction, now):
            self.seen.append((address, instruction.number, now))

        def event(self, kind, motor, now):
            self.seen.append((kind, motor, now))

    module = switched_on()
    host = Host(module)
    recorder = Recorder()
    module.observers.append(recorder)
    host.wait_ms(1)
    host.do("GAP 4, 0")
    module.reset()
    assert recorder.seen == [
        ("in", "0106040000000000" + "0b", MS),
        ("out", "02016406000003e8" + "58", MS),
        ("power", -1, MS),
    ]


def test_a_module_is_switched_on_and_off_once():
    module = switched_on()
    host = Host(module)
    host.do("SAP 4, 0, 77")
    module.power_on()
    assert host.do("GAP 4, 0") == 77
    module.power_off()
    module.power_off()
    assert not module.powered


@pytest.mark.parametrize(
    ("line", "status"), [("139 0, 0, 0", 6), ("136 0, 0, 0", 100), ("138 0, 0, 7", 100), ("135 0, 0, 0", 100)]
)
def test_control_functions_without_a_wire(line, status):
    assert switched_on().execute(parse_instruction(line))[0] == status


def test_time_passes_for_a_module_that_is_off():
    module = switched_on()
    module.power_off()
    run_until(module, 10 * HZ)
    assert module.now == 10 * HZ
    module.power_on()
    assert Host(module).do("GGP 132, 0") == 0


@pytest.mark.parametrize("clocks", [1600, 100])
def test_an_instruction_of_a_program_takes_its_time(clocks):
    eeprom = Eeprom()
    eeprom.write_program(
        [Instruction(19, 9, 0, n) for n in range(9)] + [Instruction(14, 0, 2, 1), Instruction(28)]
    )
    module = (
        switched_on(eeprom=eeprom)
        if clocks == 1600
        else switched_on(eeprom=eeprom, instruction_clocks=clocks)
    )
    seen = []
    module.board.on_output.append(lambda bits: seen.append((module.now, bits)))
    module.execute(Instruction(129))
    run_until(module, HZ)
    assert seen == [(10 * clocks, 1)]
