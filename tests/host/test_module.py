"""Modules, axes and programs through the host library: in this process, on a pseudo terminal and over TCP."""

import pytest

from tmcm34x.clock import clocks, run_until
from tmcm34x.host import (
    Connection,
    HostError,
    Module,
    NoReplyError,
    NotAvailableError,
    NotReachedError,
    Program,
    ProtectedError,
    RangeError,
    RefusedError,
    VerifyError,
    connect,
)
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.datagram import Instruction


@pytest.fixture(scope="module")
def served(serve_once):
    """One module on a pseudo terminal and on TCP, twenty times as fast as a real one."""
    return serve_once("--pty", "--tcp", 0, "--speed", 20)


@pytest.fixture(params=["memory", "pty", "tcp"])
def module(request, served):
    """A module as it left the factory, at the other end of each kind of line."""
    url = "virtual:343" if request.param == "memory" else getattr(served, request.param)
    with Connection.open(url, timeout=0.1, retries=500) as connection:
        module = Module(connection)
        module.restore_factory_settings()
        assert module.tick_timer >= 0  # it is back
        connection.timeout_s = 60.0
        yield module


def arrives(module, axis, position, wait_for):
    """Whether an axis comes to rest there; asking lets virtual time pass where nothing else does."""

    def there():
        if axis.actual_position == position and axis.actual_speed == 0:
            return True
        module.connection.wait(0.01)
        return False

    return wait_for(there)


def test_version_and_model(module):
    assert (module.version, module.model) == ("343V4.36", 343)


def test_axis_parameters_are_attributes(module):
    x, y, _ = module.axes
    x.max_speed = 1234
    y.max_speed = 432
    assert (x.max_speed, y.max_speed) == (1234, 432)
    assert set(axis_parameters.BY_KEY) <= set(dir(x))


def test_every_readable_parameter_can_be_read(module):
    for row in axis_parameters.AXIS_PARAMETERS:
        if row.readable:
            assert isinstance(getattr(module.axes[2], row.key), int), row.key
    for row in global_parameters.GLOBAL_PARAMETERS:
        if row.readable and row.bank == 0:
            assert isinstance(getattr(module, row.key), int), row.key


def test_names_that_no_table_has_are_attribute_errors(module):
    with pytest.raises(AttributeError, match="colour"):
        _ = module.axes[0].colour
    with pytest.raises(AttributeError, match="colour"):
        module.colour = 3
    with pytest.raises(AttributeError, match="no axis parameter 'colour'"):
        module.axes[0].store("colour")
    with pytest.raises(AttributeError):
        _ = module.user_variable_3


def test_what_the_tables_know_to_be_wrong_is_not_sent(module):
    sent = module.connection.counts.sent
    with pytest.raises(RangeError, match=r"max_speed \(4\) is 0 to 2047 velocity units, not 5000"):
        module.axes[0].max_speed = 5000
    with pytest.raises(AttributeError):
        module.axes[0].position_reached = 1
    with pytest.raises(RangeError, match="can only be read"):
        module.axes[0].write("position_reached", 1)
    with pytest.raises(RangeError, match="position is"):
        module.axes[0].move_to(2**23)
    with pytest.raises(RangeError):
        module.coordinates[1, 0] = 2**23
    assert module.connection.counts.sent == sent


def test_refusals_are_exceptions(module):
    with pytest.raises(RefusedError, match=r"SAP 4, 0, 5000: status 4, invalid value"):
        module.connection.command(5, 4, 0, 5000)


def test_what_another_model_has_is_not_available():
    with connect("virtual:342") as module:
        with pytest.raises(NotAvailableError, match=r"max_current \(6\) is not available on a TMCM-342"):
            _ = module.axes[0].max_current
        assert module.axes[0].max_speed == 1000


def test_store_and_restore(module):
    axis = module.axes[1]
    axis.max_acceleration = 321
    axis.store("max_acceleration")
    axis.max_acceleration = 123
    axis.restore("max_acceleration")
    assert axis.max_acceleration == 321


def test_moves(module, wait_for):
    axis = module.axes[0]
    axis.move_to(-3000)
    assert arrives(module, axis, -3000, wait_for)
    axis.move_by(500)
    assert arrives(module, axis, -2500, wait_for)
    module.coordinates[5, 0] = 700
    axis.move_to_coordinate(5)
    assert arrives(module, axis, 700, wait_for)
    module.coordinates.capture(6, 0)
    assert module.coordinates[6, 0] == 700


def test_rotation_and_stop(module, wait_for):
    axis = module.axes[2]
    axis.rotate(-300)
    assert axis.target_speed == -300
    module.stop_all()
    assert axis.target_speed == 0
    assert not axis.searching


def test_variables(module):
    module.variables[7] = -5
    assert module.variables[7] == -5
    module.variables.store(7)
    assert len(list(module.variables)) == len(module.variables) == 56
    with pytest.raises(IndexError):
        _ = module.variables[56]


def test_inputs_and_outputs(module):
    module.write_output(3, 1)
    assert module.read_output(3) == 1
    assert module.read_output(255) == 8
    assert module.read_input(255) in range(256)
    assert module.read_analog_input(0) in range(1024)


def test_an_event_is_kept_until_somebody_asks(module, wait_for):
    module.axes[0].move_to(2000)
    module.request_event(1)

    def told():
        module.connection.wait(0.02)
        return len(module.connection.events)

    assert wait_for(told)
    assert (module.connection.events[0].status, module.connection.events[0].value) == (128, 1)


PROGRAM = (*(Instruction(9, n % 56, 2, n * 7919) for n in range(40)), Instruction(28))


def test_a_program_is_downloaded_verified_and_uploaded(module):
    program, seen = Program(module.connection), []
    program.download(PROGRAM, progress=lambda *progress: seen.append(progress))
    assert program.upload() == PROGRAM
    assert seen[-1] == (84, 84)
    assert program.upload(address=40, size=2) == (Instruction(28), Instruction(0))


def test_a_program_runs_steps_and_resets(module, wait_for):
    program = Program(module.connection)
    program.download(PROGRAM)
    program.step()
    module.connection.wait(0.01)
    assert program.state == (0, 1)
    program.restart()

    def over():
        module.connection.wait(0.01)
        return program.state.status == 0

    assert wait_for(over)
    assert module.variables[39] == 39 * 7919
    program.reset()
    assert program.state.counter == 0


def test_a_protected_program_cannot_be_read(module):
    program = Program(module.connection)
    program.download(PROGRAM)
    module.code_protection = 1
    with pytest.raises(ProtectedError, match="protected against reading"):
        program.upload()
    module.code_protection = 2
    with pytest.raises(ProtectedError, match="protected against overwriting"):
        program.download(PROGRAM)
    module.code_protection = 3
    module.code_protection = 0


def test_a_program_that_cannot_be_read_back_is_not_called_stored(module):
    module.code_protection = 1
    with pytest.raises(VerifyError, match="stored but cannot be read back"):
        Program(module.connection).download(PROGRAM)
    module.code_protection = 0


def test_what_does_not_arrive_as_sent_is_noticed():
    """Another host overwrites an instruction between storing and reading back."""
    with connect("virtual:343") as module:
        eeprom = module.connection.line.rig.modules[0].eeprom

        def progress(done, total):
            if done == total // 2:
                eeprom.write_instruction(40, Instruction(99))

        with pytest.raises(VerifyError, match="address 40: 99 0, 0, 0 instead of STOP"):
            Program(module.connection).download(PROGRAM, progress=progress)


def test_a_program_that_does_not_fit_is_not_sent(module):
    with pytest.raises(RangeError, match="do not fit at address 2040: there is room for 8"):
        Program(module.connection).download(PROGRAM, address=2040)


def test_silence_is_an_exception(module):
    absent = Connection(module.connection.line, address=9, timeout_s=0.02, retries=0)
    with pytest.raises(NoReplyError, match="GAP 1, 0: no reply in time; check power") as caught:
        absent.command(6, 1)
    assert isinstance(caught.value, HostError)


def test_a_move_is_waited_for(module):
    axis = module.axes[0]
    axis.move_to(5000, wait=True, timeout_s=20)
    assert (axis.actual_position, axis.actual_speed) == (5000, 0)
    axis.move_by(-1000, wait=True)
    assert axis.actual_position == 4000


def test_a_move_that_takes_too_long_is_an_error_and_goes_on(module):
    axis = module.axes[0]
    axis.max_speed = 10
    with pytest.raises(NotReachedError, match=r"its target is 50000: it is not there after 0.1 s"):
        axis.move_to(50_000, wait=True, timeout_s=0.1)
    assert axis.actual_speed
    axis.stop()


def test_a_motor_that_stops_elsewhere_is_not_waited_for(module):
    axis = module.axes[1]
    axis.max_speed = 500
    axis.move_to(8_000_000)
    axis.stop()
    with pytest.raises(NotReachedError, match="it has stopped"):
        axis.wait_reached(30)


def test_an_exception_stops_the_motors_where_asked():
    module = connect("virtual:343", stop_on_error=True)
    rig = module.connection.line.rig
    with pytest.raises(ZeroDivisionError), module:
        module.axes[0].rotate(500)
        _ = 1 / 0
    run_until(rig, rig.now + clocks(1))
    assert rig.worlds[0].view()[0].speed == 0
