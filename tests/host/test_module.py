"""Modules, axes and programs through the host library: in this process, on a pseudo terminal and over TCP."""

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.clock import clocks, run_until
from tmcm34x.host import (
    Connection,
    HostError,
    MemoryStream,
    Module,
    NoReplyError,
    Program,
    RefusedError,
    VerifyError,
    open_stream,
)
from tmcm34x.links.memory import MemoryClient
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.datagram import Instruction


class Wire:
    """The end of a rig's line, for a client in this process."""

    def __init__(self, rig):
        self.rig = rig

    def connect(self, _, send):
        port = self.rig.modules[0].open_serial_port(send)
        self.receive = port.receive
        return self

    def disconnect(self):
        self.rig.modules[0].ports.clear()

    def wait(self, seconds):
        run_until(self.rig, self.rig.now + clocks(seconds))


def in_process():
    wire = Wire(simple_rig())
    return MemoryStream(MemoryClient(wire.connect), wire.wait)


@pytest.fixture(scope="module")
def served(serve_once):
    """One module on a pseudo terminal and on TCP, twenty times as fast as a real one."""
    return serve_once("--pty", "--tcp", 0, "--speed", 20)


@pytest.fixture(params=["memory", "pty", "tcp"])
def module(request, served):
    """A module as it left the factory, at the other end of each kind of line."""
    stream = in_process() if request.param == "memory" else open_stream(getattr(served, request.param))
    with Connection(stream, timeout_s=0.1, retries=20) as connection:
        module = Module(connection)
        module.restore_factory_settings()
        assert module.tick_timer >= 0  # it is back
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
    with pytest.raises(AttributeError, match="no axis parameter 'colour'"):
        _ = module.axes[0].colour
    with pytest.raises(AttributeError, match="no global parameter 'colour'"):
        module.colour = 3
    with pytest.raises(AttributeError):
        _ = module.user_variable_3


def test_refusals_are_exceptions(module):
    with pytest.raises(RefusedError, match=r"SAP 4, 0, 5000: status 4, invalid value"):
        module.axes[0].max_speed = 5000
    with pytest.raises(RefusedError, match="status 3"):
        module.axes[0].position_reached = 1


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
    with pytest.raises(RefusedError, match="status 6"):
        program.upload()
    module.code_protection = 0


def test_what_does_not_arrive_as_sent_is_noticed(module):
    class Forgetful(Program):
        def download(self, instructions, **options):
            super().download([*instructions[:-1], Instruction(99)], **options, verify=False)
            for address, instruction in enumerate(instructions):
                self._verify(address, instruction)

    with pytest.raises(VerifyError, match="address 40: 99 0, 0, 0 instead of STOP"):
        Forgetful(module.connection).download(PROGRAM)


def test_a_program_that_does_not_fit_is_not_sent(module):
    with pytest.raises(ValueError, match="do not fit"):
        Program(module.connection).download(PROGRAM, address=2040)


def test_silence_is_an_exception(module):
    absent = Connection(module.connection._stream, address=9, timeout_s=0.02, retries=0)
    with pytest.raises(NoReplyError, match=r"GAP 1, 0: no reply within 0\.02 s") as caught:
        absent.command(6, 1)
    assert isinstance(caught.value, HostError)
