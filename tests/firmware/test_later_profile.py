"""The profile "later": some parameters of the vendor's later firmware (fidelity TMCL-18)."""

import pytest
from click.testing import CliRunner

from firmware.hosts import Host, switched_on
from tmcm34x.bench import build
from tmcm34x.bench.description import parse
from tmcm34x.cli.run import command as run
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.axis_parameters import LATER_AXIS_PARAMETERS
from tmcm34x.tmcl.datagram import Instruction, pack_can_request, pack_request
from tmcm34x.tmcl.global_parameters import LATER_GLOBAL_PARAMETERS
from tmcm34x.tmcl.numbers import COMMAND


def later(model=343, **options):
    return switched_on(model, profile="later", **options)


@pytest.mark.parametrize("model", [341, 342, 343])
def test_parameters_of_later_firmware_exist_only_there(model):
    plain, host = Host(switched_on(model)), Host(later(model))
    for row in LATER_AXIS_PARAMETERS:
        line = f"GAP {row.number}, 1"
        assert plain.status(line) == 3
        assert host.status(line) == (100 if model in row.models else 3)
        assert host.status(f"STAP {row.number}, 1") == (100 if row.stored and model in row.models else 3)
    for row in LATER_GLOBAL_PARAMETERS:
        assert (plain.status(f"GGP {row.number}, 0"), host.do(f"GGP {row.number}, 0")) == (3, 0)
        assert host.status(f"SGP {row.number}, 0, 1") == (100 if row.writable else 3)


def test_an_image_with_parameters_of_later_firmware_is_read_as_such():
    eeprom = Eeprom()
    assert Eeprom.from_bytes(eeprom.to_bytes()).profile != "later"
    eeprom.take_profile("later")
    eeprom.set_axis_value(2, 200, 77)
    again = Eeprom.from_bytes(eeprom.to_bytes())
    assert (again.profile, again.axis_values) == ("later", eeprom.axis_values)
    assert again.to_bytes() == eeprom.to_bytes()


def test_stored_parameters_come_back_in_a_module_of_the_same_profile():
    module = later()
    host = Host(module)
    for line in ("SAP 200, 2, 77", "STAP 200, 2", "SGP 82, 0, 500"):
        host.do(line)
    image = module.eeprom.to_bytes()
    host = Host(later(eeprom=Eeprom.from_bytes(image)))
    assert [host.do("GAP 200, 2"), host.do("GAP 200, 1"), host.do("GGP 82, 0")] == [77, 0, 500]
    assert Host(switched_on(eeprom=Eeprom.from_bytes(image))).status("GAP 200, 2") == 3
    host.module.eeprom.restore_defaults()
    host.module.reset()
    assert [host.do("GAP 200, 2"), host.do("GGP 82, 0")] == [0, 0]


def test_boost_current_flows_while_the_speed_changes():
    module = later()
    host = Host(module)
    for line in ("SAP 6, 0, 100", "SAP 200, 0, 180", "MVP ABS, 0, 100000"):
        host.do(line)
    seen = [(0, module.board.currents[0])]
    module.board.on_current.append(lambda motor, current, on: seen.append((host.do("GAP 3, 0"), current)))
    run_until(module, module.now + 6000 * MS)
    assert [current for _, current in seen] == [180, 100, 180, 8]
    assert seen[1][0] == 1000
    host.do("SAP 200, 0, 0")
    host.do("ROR 0, 500")
    assert module.board.currents[0] == 100


def test_what_stopped_a_motor_is_told_until_it_moves_again():
    module = later()
    host = Host(module)

    class Slipping:
        def exchange(self, data, nbytes):
            return 0

    module.board.attach_spi(0, Slipping())
    for line in ("SGP 74, 0, 1", "SAP 212, 0, 50", "ROR 0, 500"):
        host.do(line)
    host.wait_ms(500)
    assert host.do("GAP 2, 0") == 0
    assert host.do("GAP 207, 0") == 2
    host.do("ROR 0, 0")
    assert host.do("GAP 207, 0") == 0


def test_the_last_reference_position_is_that_before_it_became_zero():
    module = later()
    host = Host(module)
    host.do("MVP ABS, 0, 2000")
    host.wait_ms(1000)
    host.do("RFS START, 0")
    host.wait_ms(500)
    opened, closed = [], []
    for active, places in ((True, []), (False, opened), (True, closed)):
        places.append(host.do("GAP 1, 0"))
        module.board.set_switch(0, "left", active)
        host.wait_ms(100)
    host.wait_ms(2000)
    assert host.do("RFS STATUS, 0") == 0
    assert host.do("GAP 197, 0") == closed[0] + (opened[0] - closed[0]) // 2


def test_the_reference_switch_tolerance_keeps_the_switch_from_stopping_the_motor():
    module = later()
    host = Host(module)
    host.do("SAP 141, 0, 4095")
    module.board.set_switch(0, "left", True)
    host.do("MVP ABS, 0, -1000")
    host.wait_ms(1000)
    assert host.do("GAP 1, 0") == -1000


def test_a_second_address_is_answered_too():
    module = later()
    host = Host(module)
    host.port.receive(pack_request(9, Instruction(COMMAND.GGP, 66)))
    assert host.replies() == []
    host.do("SGP 87, 0, 9")
    host.port.receive(pack_request(9, Instruction(COMMAND.GGP, 66)))
    assert [(reply.address, reply.value) for reply in host.replies()] == [(1, 1)]


def test_silence_on_can_stops_the_motors():
    module = later()
    Host(module).do("SGP 82, 0, 100")
    port = CanPort(module, lambda identifier, data: None)
    port.receive_frame(1, pack_can_request(Instruction(COMMAND.ROR, 0, 0, 500)))
    run_until(module, module.now + 90 * MS)
    assert module.axes[0].moving
    run_until(module, module.now + 1000 * MS)
    assert not module.axes[0].moving


def test_the_last_error_of_a_program_is_its_status():
    module = later()
    host = Host(module)
    module.eeprom.write_program([Instruction(COMMAND.SAP, 4, 0, 99999), Instruction(COMMAND.STOP)])
    host.do("129 1, 0, 0")
    host.wait_ms(5)
    assert host.do("GGP 131, 0") == 4


def test_a_module_takes_the_profile_later_on():
    module = switched_on()
    host = Host(module)
    assert host.status("GAP 200, 0") == 3
    module.take_profile("later")
    assert host.do("GAP 200, 0") == 0
    module.take_profile("standard")
    assert host.status("GAP 200, 0") == 3


def test_what_a_later_profile_stored_has_no_effect_without_it():
    module = later()
    host = Host(module)
    for line in ("SAP 200, 0, 255", "STAP 200, 0"):
        host.do(line)
    plain = switched_on(eeprom=Eeprom.from_bytes(module.eeprom.to_bytes()))
    Host(plain).do("ROR 0, 500")
    assert plain.board.currents[0] == 128


def test_a_bench_and_the_command_line_choose_the_profile(tmp_path):
    rig = build(parse('[[module]]\nparameters = "later"\n[[module]]\n'))
    assert [module.peek(Instruction(COMMAND.GAP, 207))[0] for module in rig.modules] == [100, 3]
    program = tmp_path / "boost.tmc"
    program.write_text("SAP 200, 0, 5\nGAP 200, 0\nAGP 0, 2\nSTOP\n")
    for arguments, status in (((), 3), (("--parameters", "later"), 0)):
        assert (
            CliRunner().invoke(run, [str(program), *arguments], standalone_mode=False).return_value == status
        )


def test_an_image_of_the_later_profile_is_read_as_one() -> None:
    eeprom = Eeprom(343)
    eeprom.take_profile("later")
    assert Eeprom.from_bytes(eeprom.to_bytes()).profile == "later"
