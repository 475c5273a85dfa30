"""What the IDE's server and its page say to each other: the one definition.

Text messages on the web socket are JSON.  The page sends a `Request` (a number and a call); the server
answers each with `CallResult`, `Refusal` or `Fault`, and sends further events when something happens by itself.  Binary
messages are state frames: a mask byte, then for each set bit, lowest first, one group of `GROUPS` packed as its
rows say, little-endian.  A group is sent only when it differs from what that page was last sent.

`python -m tmcm34x.ide.typescript` writes `web/src/wire.ts` from this file; a test keeps it fresh.
"""

from __future__ import annotations

import struct
from typing import Any, ClassVar, Final, Literal, NamedTuple, get_args

import msgspec

from tmcm34x.toolchain.diagnostics import printable

PROTOCOL: Final = 5
"""Raised when a page built earlier would no longer understand the server."""

MESSAGE_LIMIT: Final = 4 << 20
"""Bytes of the largest message that the server reads; a larger one closes the web socket (code 1009)."""

MALFORMED: Final = 1007
"""Code with which the server closes a web socket on which something came that is no message."""

# ------------------------------------------------------------------------------------------------ state frames


class StateRow(NamedTuple):
    """One value of a state group: name, `struct` code, what it is."""

    name: str
    code: str
    meaning: str


class Group(NamedTuple):
    """Values that are sent together."""

    name: str
    rows: tuple[StateRow, ...]

    @property
    def layout(self) -> struct.Struct:
        """How the group is packed."""
        return struct.Struct("<" + "".join(row.code for row in self.rows))


_MOTOR: Final = (
    StateRow("position", "i", "actual position [microsteps]"),
    StateRow("target", "i", "target position [microsteps]"),
    StateRow("speed", "h", "actual speed [velocity units]"),
    StateRow("target_speed", "h", "target speed [velocity units]"),
    StateRow("acceleration", "h", "actual acceleration [acceleration units]"),
    StateRow("encoder", "i", "encoder position [encoder steps]"),
    StateRow("flags", "H", "bits of MOTOR_FLAGS"),
    StateRow("load", "B", "load value 0..7"),
    StateRow("errors", "B", "driver error flags, axis parameter 208"),
    StateRow("current", "B", "coil current now [1/255 of the module's maximum]"),
    StateRow("mode", "B", "ramp mode, axis parameter 138"),
    StateRow("search", "B", "reference search: state, 0 idle"),
    StateRow("resolution", "B", "microstep resolution, axis parameter 140"),
    StateRow("pulse_div", "B", "pulse divisor, axis parameter 154"),
    StateRow("ramp_div", "B", "ramp divisor, axis parameter 153"),
    StateRow("angle", "f", "rotor angle [rad], from the world where there is one, else from the position"),
    StateRow("slip", "i", "full steps lost since power-on; 0 without a world"),
    StateRow("strain", "f", "torque asked of the motor over what it has, 0..1; 0 without a world"),
    StateRow("place", "f", "position of the load [mm or degrees]; 0 without a world"),
)

MOTOR_FLAGS: Final = ("left", "right", "home", "reached", "left_off", "right_off", "energised", "stalled")
"""Bits of a motor's `flags`, lowest first: switches as the chip sees them, target reached, switches disabled,
coils energised, stopped by stall detection."""

GROUPS: Final = (
    Group("time", (
        StateRow("clock", "d", "virtual time in chip clocks; wall time of the sample on a real module"),
        StateRow("speed", "f", "virtual seconds to a wall second, as reached"),
        StateRow("asked", "f", "virtual seconds to a wall second, as asked; 0 is as fast as possible"),
        StateRow("flags", "B", "bits of TIME_FLAGS"),
    )),
    Group("program", (
        StateRow("state", "B", "0 stop, 1 run, 2 step, 3 reset (parameter 128)"),
        StateRow("paused", "B", "1 while held by the debugger"),
        StateRow("flags", "H", "bits of PROGRAM_FLAGS"),
        StateRow("counter", "H", "address of the next instruction (parameter 130)"),
        StateRow("depth", "B", "open CSUB calls"),
        StateRow("accumulator", "i", "accumulator"),
        StateRow("x", "i", "X register"),
    )),
    Group("motor0", _MOTOR),
    Group("motor1", _MOTOR),
    Group("motor2", _MOTOR),
    Group("board", (
        StateRow("inputs", "B", "digital inputs, bit 0 is input 0"),
        StateRow("outputs", "B", "digital outputs"),
        StateRow("shutdown", "B", "level of the SHUTDOWN pin"),
        *(StateRow(f"analog{n}", "H", f"analogue input {n}, 0..1023") for n in range(8)),
    )),
    Group("quality", (
        *(StateRow(f"motor{n}", "I", f"unknown values of motor {n}: bit n for row n of its group") for n in range(3)),
        StateRow("program", "H", "unknown values of the program"),
        StateRow("board", "H", "unknown values of the board"),
        StateRow("seen", "d", "when the module last sent a value [clocks of `time`]; -1 where all values are of now"),
    )),
)  # fmt: skip
"""State groups; the index is the bit in the mask byte of a frame."""


class CurveRow(NamedTuple):
    """A column of each motor in the samples for plots: name, and the axis parameter that it is, if any."""

    name: str
    key: str


CURVES: Final = (
    CurveRow("position", "actual_position"), CurveRow("target", "target_position"), CurveRow("speed", "actual_speed"),
    CurveRow("target_speed", "target_speed"), CurveRow("load", "load_value"), CurveRow("current", ""),
    CurveRow("encoder", "encoder_position"), CurveRow("acceleration", "actual_acceleration"),
)  # fmt: skip
"""Columns of a motor, all columns of motor 0 first; after the motors come the program counter, the outputs and the
watched parameters."""

TIME_FLAGS: Final = ("paused", "powered", "plugged", "past", "foreign")
"""The last one: the memory held another program at the past moment that is shown."""
PROGRAM_FLAGS: Final = ("zero", "equal", "lower", "greater", "eto", "eal", "edv", "epo", "esd", "downloading")
WATCH_BIT: Final = 7
"""Bit of the mask byte for the watched parameters, in the order of `Watch`: a byte with a bit for each that is known,
then one signed 32-bit value each, 0 for one that is not."""


# ------------------------------------------------------------------------------------------------ shared shapes


class Shape(msgspec.Struct):
    """A record inside messages."""


Severity = Literal["error", "warning", "information", "hint"]
Source = Literal["virtual", "serial", "tcp", "can", "slcan"]
MotionKind = Literal["jog", "profile", "search", "zero", "go", "turn", "store", "restore"]
"""What a window may have under way; see `Authority`."""
Keeping = Literal["store", "restore"]
Drawn = Literal["rail", "turntable", "belt", "shaft"]


class Choice(Shape):
    """One named value of a parameter."""

    value: int
    text: str


class Parameter(Shape):
    """A row of the parameter tables; `bank` is -1 for an axis parameter.

    `kind` says what its value is, `group` under which title it is listed, `bits` what each bit stands for.
    """

    bank: int
    number: int
    key: str
    name: str
    access: str
    low: int
    high: int
    default: int
    unit: str
    meaning: str
    section: str
    choices: list[Choice]
    kind: str
    group: str
    bits: list[str]
    acts: bool
    """Reading it does something in a module at the end of a line, so that it is read when asked for only."""


class OperandShape(Shape):
    """One operand of a command."""

    name: str
    field: Literal["type", "motor", "value"]
    kind: str
    low: int
    high: int
    words: list[Choice]
    required: bool


class CommandShape(Shape):
    """A row of the command table."""

    number: int
    mnemonic: str
    syntax: str
    title: str
    meaning: str
    section: str
    where: list[str]
    operands: list[OperandShape]


class ModelShape(Shape):
    """What kind of module this is."""

    number: int
    name: str
    version: str
    drivers: bool
    """It has motor drivers of its own, which measure load and current."""
    max_current_ma: int | None
    """Coil current of setting 255; null where that depends on the board."""
    shutdown_pin: int
    """Its number on the connector."""
    known: bool
    """The module has said that it is one; a TMCM-343 is assumed until then."""


class Tables(Shape):
    """The vocabulary, as the firmware and the assembler read it."""

    commands: list[CommandShape]
    control: list[CommandShape]
    axis: list[Parameter]
    globals: list[Parameter]
    axis_groups: list[str]
    """Titles of groups, in the order of a page."""
    global_groups: list[str]
    """The first is that of the chips, which the manual warns of."""
    statuses: list[Choice]
    sister_commands: list[str]
    functions: list[str]
    clock_hz: int
    program_size: int
    coordinates: int
    stack_depth: int


class Ability(Shape):
    """What the page may offer with this module."""

    bench: bool
    """Switches, loads, pins and time can be set."""
    debug: bool
    """Breakpoints hold the program, registers can be read."""
    peek: bool
    """Every value is read without a telegram."""
    language_server: bool
    history: bool
    """Past moments can be shown."""
    irreversible: str
    """Why not; empty where they can."""


class FileEntry(Shape):
    """A file or folder below the opened one; `stamp` changes with its contents."""

    path: str
    folder: bool
    size: int
    stamp: str


class FileText(Shape):
    """A file's text; `newline` is how it ends its lines."""

    path: str
    text: str
    stamp: str
    newline: Literal["\n", "\r\n"]


class SourceRange(Shape):
    """A place in a source file, from 1."""

    path: str
    line: int
    column: int
    end_line: int
    end_column: int


class Doubt(Shape):
    """A motor that has not confirmed rest, and why; motor -1 is the program that has not confirmed its stop."""

    motor: int
    why: str


class MotionShape(Shape):
    """Something that the server does for a window in more than one command."""

    number: int
    kind: MotionKind
    motors: list[int]
    window: int
    """Number of the window that it belongs to."""


class Reasons(Shape):
    """Why a motor does not turn, and values without which a reason may be missing."""

    reasons: list[str]
    unknown: list[str]


class Problem(Shape):
    """A diagnostic."""

    place: SourceRange
    severity: Severity
    code: str
    text: str


class ListingLine(Shape):
    """One instruction of an assembled program and where it comes from; line 0 is nowhere."""

    address: int
    path: str
    line: int
    record: str
    """Eight bytes of the program image, in hexadecimal."""
    text: str


class SymbolShape(Shape):
    """A label or constant."""

    name: str
    kind: Literal["label", "constant"]
    value: str


class Listing(Shape):
    """An assembled program; `identity` is the same for the same instructions."""

    path: str
    identity: str
    lines: list[ListingLine]
    symbols: list[SymbolShape]


class Assembled(Shape):
    """What the assembler says; `listing` is missing when there are errors.

    lines: for each address the line of the assembled file that it comes from, 0 where that is another file
    """

    problems: list[Problem]
    listing: Listing | None
    lines: list[int]


class PortShape(Shape):
    """A serial port of the server's computer."""

    device: str
    description: str


class Ports(Shape):
    """Where modules may be: serial ports, and the CAN interfaces that python-can knows."""

    serial: list[PortShape]
    can: list[str]
    closed: str
    """Why pages may open none of them; empty where they may."""


class BuildOptions(Shape):
    """How a program is assembled.

    model: the module that it is for, 341, 342 or 343; 0 is the one at hand
    append_stop: put a STOP at its end, as the TMCL-IDE does
    """

    model: int = 0
    append_stop: bool = True


class Site(Shape):
    """A line of a source."""

    path: str
    line: int


class RoutineShape(Shape):
    """An entry point or subroutine of a program.

    calls: the names of the routines that it calls itself
    longest: instructions of the longest way without a WAIT, None where a loop has none; `ms` is their time
    """

    name: str
    path: str
    line: int
    instructions: int
    calls: list[str]
    longest: int | None
    ms: float | None


class VariableShape(Shape):
    """A user variable of a program, and the lines that write and read it."""

    number: int
    writers: list[Site]
    readers: list[Site]


class LabelShape(Shape):
    """A label: the line of its instruction, and its address."""

    name: str
    path: str
    line: int
    address: int


class FlowMap(Shape):
    """The flow of a program: routines, the greatest number of calls open at once, user variables, labels."""

    path: str
    instructions: int
    stack: int
    routines: list[RoutineShape]
    variables: list[VariableShape]
    labels: list[LabelShape]


class CoveredLine(Shape):
    """How often the command of a line was executed; of a JC also how often it jumped."""

    path: str
    line: int
    executed: int
    jumped: int | None


class DiffRow(Shape):
    """A line of a comparison; a number of -1 is no line on that side."""

    kind: Literal["same", "changed", "gone", "new"]
    left: int
    left_text: str
    right: int
    right_text: str


class Comparison(Shape):
    """Two texts side by side, and what each of them is."""

    path: str
    left: str
    right: str
    same: bool
    rows: list[DiffRow]


class FieldShape(Shape):
    """Bits `high` to `low` of a register; `access` has R, W and C, cleared by writing ones."""

    name: str
    high: int
    low: int
    access: str
    value: int


class RegisterShape(Shape):
    """A register of a motion chip as it is now; `motor` is -1 for one that all motors of the chip share."""

    chip: int
    motor: int
    name: str
    index: int
    value: int
    section: str
    fields: list[FieldShape]


class Exchange(Shape):
    """One command and its answer; status 0 is no answer in time."""

    text: str
    sent: str
    received: str
    status: int
    value: int
    meaning: str


class Imported(Shape):
    """What became of settings that were set: how many there were, and those that the module refused."""

    count: int
    refused: list[str]


class BenchCheck(Shape):
    """What is wrong with a file as a bench; not `bench` for a TOML file of another kind."""

    bench: bool
    problems: list[Problem]


class Suggestion(Shape):
    """What may stand at the cursor of a bench file; `text` takes the place of the word before it."""

    label: str
    detail: str
    meaning: str
    text: str


class ExampleShape(Shape):
    """A program of the examples; `bench` is that of its machine, empty for bare motors.

    path, bench: names for `ReadExample`; `includes` are beside the program
    """

    path: str
    title: str
    text: str
    bench: str
    includes: list[str]


class BenchShape(Shape):
    """A bench of the examples."""

    path: str
    title: str


class Examples(Shape):
    """What came with the package."""

    programs: list[ExampleShape]
    benches: list[BenchShape]


class Telegram(Shape):
    """A line of the telegram log."""

    number: int
    clock: float
    link: str
    direction: Literal["in", "out"]
    data: str
    text: str
    status: int
    """Of a reply; 0 for a request."""
    request: int
    """Of a reply: number of the telegram with its request; 0 where that is not known, and for a request."""
    latency: float
    """Of a reply whose request is known: clocks between the two."""


class Watched(Shape):
    """A value to read: bank -1 is an axis parameter of `motor`, -2 a coordinate."""

    bank: int
    number: int
    motor: int

    def __hash__(self) -> int:
        return hash((self.bank, self.number, self.motor))


class Cam(Shape):
    """Load positions from which to which a switch is pressed; None is no end."""

    side: Literal["left", "right"]
    low: float | None
    high: float | None


class AxisWorld(Shape):
    """What hangs on one motor: what the page cannot see in the chip."""

    motor: str
    load: float
    """Torque of a hand on the shaft, as a part of the motor's holding torque; positive pushes left."""
    faults: list[str]
    """Driver faults that are held on."""
    left_held: bool
    """A hand keeps the left switch closed."""
    right_held: bool
    unit: str
    """Of the load's position."""
    turn: float
    """Load positions in a turn of the motor; negative where counting up moves to lower ones."""
    fullsteps: int
    """Of a turn."""
    low: float | None
    """Lower hard stop."""
    high: float | None
    cams: list[Cam]
    """The axis's own switches."""
    name: str
    """What the bench calls the axis; may be empty."""
    shape: Drawn
    """How it is drawn."""


class FaultKind(Shape):
    """A driver fault that a bench can raise."""

    name: str
    meaning: str


class World(Shape):
    """The bench's settings that pages set and show."""

    axes: list[AxisWorld]
    faults: list[FaultKind]
    bench: str
    inputs: list[int]
    """Inputs that a hand holds although the bench has a source for them."""
    plane: list[int]
    """Motors of two carriages that move one tool, X first; empty for none."""


class Branch(Shape):
    """One course of events in the history; clocks are virtual time in chip clocks."""

    number: int
    parent: int
    """Of the branch that it left, -1 of the first."""
    since: float
    """When it left that."""
    oldest: float
    """The oldest moment that can be reached."""
    end: float
    inputs: int
    """How much came from outside: telegrams, actions on the bench, a debugger's commands."""


class Mark(Shape):
    """Something that happened, as in `Happened`."""

    clock: float
    kind: str
    motor: int
    text: str


class Marks(Shape):
    """What happened in a branch from `oldest` to `end`; `telegrams` counts them in equal parts of that time."""

    oldest: float
    end: float
    telegrams: list[int]
    marks: list[Mark]


class StoredValue(Shape):
    """A value in the EEPROM; bank -1 is an axis parameter, -2 a coordinate."""

    bank: int
    number: int
    motor: int
    value: int


class Eeprom(Shape):
    """The module's EEPROM: the image in hexadecimal, and the settings in it."""

    image: str
    values: list[StoredValue]
    file: str


# ------------------------------------------------------------------------------------------------ calls


class Call(msgspec.Struct, tag_field="call", forbid_unknown_fields=True):
    """Something a page asks for; `returns` is the type of the answer's result."""

    returns: ClassVar[Any] = None


class ListFiles(Call, tag="list_files"):
    """All files below the opened folder."""

    returns: ClassVar[Any] = list[FileEntry]


class ReadFile(Call, tag="read_file"):
    """The text of one file."""

    path: str
    returns: ClassVar[Any] = FileText


class WriteFile(Call, tag="write_file"):
    """Save a text; refused with code `changed` when the file is no longer the one of `stamp`.

    An empty `stamp` is a new file, `*` overwrites whatever is there.
    """

    path: str
    text: str
    stamp: str
    newline: Literal["\n", "\r\n"] = "\n"
    returns: ClassVar[Any] = FileEntry


class RenameFile(Call, tag="rename_file"):
    """Give a file another path; refused when that exists."""

    path: str
    to: str


class DeleteFile(Call, tag="delete_file"):
    """Remove one file."""

    path: str


class Assemble(Call, tag="assemble"):
    """Assemble a file; `texts` are editor pages that stand before the files on disk."""

    path: str
    texts: dict[str, str] = {}
    options: BuildOptions = msgspec.field(default_factory=BuildOptions)
    returns: ClassVar[Any] = Assembled


class Download(Call, tag="download"):
    """Assemble and, without errors, store the program in the module; then start it if asked."""

    path: str
    texts: dict[str, str] = {}
    run: bool = False
    replace: bool = False
    """Also over a program that was not loaded through this server; refused with code `unknown` otherwise."""
    options: BuildOptions = msgspec.field(default_factory=BuildOptions)
    returns: ClassVar[Any] = Assembled


class Upload(Call, tag="upload"):
    """Read the module's program memory and disassemble it."""

    returns: ClassVar[Any] = str


class Adopt(Call, tag="adopt"):
    """Say that a text is the module's program; true when it assembles to what the memory holds."""

    path: str
    texts: dict[str, str] = {}
    options: BuildOptions = msgspec.field(default_factory=BuildOptions)
    returns: ClassVar[Any] = bool


class Compare(Call, tag="compare"):
    """Compare the text on screen with its file, or the program that it makes with the one in the module.

    A text that makes the module's program is its source from then on, as with `Adopt`.
    """

    path: str
    against: Literal["disk", "module"]
    texts: dict[str, str] = {}
    options: BuildOptions = msgspec.field(default_factory=BuildOptions)
    returns: ClassVar[Any] = Comparison


class ReadMap(Call, tag="read_map"):
    """The flow of a program; null where it has errors or no instructions."""

    path: str
    texts: dict[str, str] = {}
    options: BuildOptions = msgspec.field(default_factory=BuildOptions)
    returns: ClassVar[Any] = FlowMap | None


class Cover(Call, tag="cover"):
    """Count from now on how often a virtual module executes each command of its program, or no more."""

    on: bool


class ReadCoverage(Call, tag="read_coverage"):
    """What has been counted; nothing while the program has no known source."""

    returns: ClassVar[Any] = list[CoveredLine]


class ReadTracefile(Call, tag="read_tracefile"):
    """What an lcov tracefile counts, such as `tmcm34x run --coverage` writes."""

    file: bytes
    returns: ClassVar[Any] = list[CoveredLine]


class ReadRegisters(Call, tag="read_registers"):
    """The registers of a virtual module's motion chips, read without acting on them."""

    returns: ClassVar[Any] = list[RegisterShape]


class Why(Call, tag="why"):
    """Why a motor does not turn: a line for each reason, the most likely first, and what the module did not say.

    Reads parameters over the line; nothing that acts.
    """

    motor: int
    returns: ClassVar[Any] = Reasons


class ControlProgram(Call, tag="control_program"):
    """Run from the start, stop, or reset, as a host does; everything finer is the debugger's."""

    action: Literal["run", "stop", "reset"]


class Execute(Call, tag="execute"):
    """Send one command to the module and wait for the answer.

    Refused with code `confirm` and a summary when it cannot be undone, unless `sure`; with `disarmed` or `latched`
    when it would set a motor in motion and that is not allowed.
    """

    number: int
    type: int = 0
    motor: int = 0
    value: int = 0
    sure: bool = False
    returns: ClassVar[Any] = Exchange


class ExecuteText(Call, tag="execute_text"):
    """Send one command, written as in a source file; refused as `Execute` is."""

    line: str
    sure: bool = False
    returns: ClassVar[Any] = Exchange


class SendAscii(Call, tag="send_ascii"):
    """Send one line to the ASCII interface, address letter included; what came back.  `BIN` leaves it."""

    line: str
    returns: ClassVar[Any] = str


class ReadMany(Call, tag="read_many"):
    """Read axis parameters, global parameters or coordinates without log lines; null where refused."""

    items: list[Watched]
    returns: ClassVar[Any] = list[int | None]


class StopAll(Call, tag="stop_all"):
    """Stop the program and all motors, along their ramps, before anything queued; holds until `Release`.

    `Authority` tells which motors have not confirmed rest.
    """


class Release(Call, tag="release"):
    """Let STOP ALL go: motors may be set in motion again."""


class Arm(Call, tag="arm"):
    """Let motors of a real module be set in motion, or no more."""

    on: bool


class Dismiss(Call, tag="dismiss"):
    """A person has read what was found (`Authority.found`)."""


class Abort(Call, tag="abort"):
    """End a motion; its motors are brought to rest."""

    number: int


class Zero(Call, tag="zero"):
    """Stop a motor and call the place where it rests 0; the motion's number."""

    motor: int
    returns: ClassVar[Any] = int


class Search(Call, tag="search"):
    """Do the reference search of one motor; the motion's number."""

    motor: int
    returns: ClassVar[Any] = int


class Go(Call, tag="go"):
    """Move motors to a stored coordinate; the motion's number."""

    coordinate: int
    motors: list[int]
    returns: ClassVar[Any] = int


class Turn(Call, tag="turn"):
    """Turn a motor, as long as this window lives and says nothing else; negative is left; the motion's number."""

    motor: int
    velocity: int
    returns: ClassVar[Any] = int


class Profile(Call, tag="profile"):
    """Measure the load of a motor from velocity `low` to `high`; the motion's number."""

    motor: int
    low: int
    high: int
    step: int
    returns: ClassVar[Any] = int


class Keep(Call, tag="keep"):
    """Store parameters in the EEPROM, or restore them from it, one by one; the motion's number.

    Storing in a real module is refused with code `confirm` and a summary, unless `sure`.
    """

    action: Keeping
    items: list[Watched]
    sure: bool = False
    returns: ClassVar[Any] = int


class Jog(Call, tag="jog"):
    """Turn a motor until its page says 0, has said nothing for a second, or is gone; to be said again and again."""

    motor: int
    velocity: int


class Stride(Call, tag="stride"):
    """Move a motor by a step of an arrow [microsteps]; steps in quick succession add up."""

    motor: int
    distance: int


class Watch(Call, tag="watch"):
    """Parameters to be sent with this page's state frames."""

    items: list[Watched]


class SetRate(Call, tag="set_rate"):
    """State frames a second for this page; 0 while the page is hidden."""

    hz: int


class FollowLog(Call, tag="follow_log"):
    """Send this page the telegram log from now on, or no more; with the IDE's own polling or without.

    since: number of the last line that the page has had
    """

    on: bool
    polls: bool = False
    since: int = 0


class SetBench(Call, tag="set_bench"):
    """Change something on the virtual bench."""

    what: Literal["left", "right", "input", "analog", "source", "shutdown", "load", "fault", "line", "power"]
    """`source` gives an input back to what the bench has for it."""
    index: int
    value: float
    fault: str = ""


class SetTime(Call, tag="set_time"):
    """Pace of virtual time: what is not given stays; `speed` 0 is as fast as possible."""

    paused: bool | None = None
    speed: float | None = None


class StepTime(Call, tag="step_time"):
    """Let virtual time go on by so many milliseconds, and hold it."""

    ms: float


class ShowPast(Call, tag="show_past"):
    """Show a moment of the history in all windows; refused with code `history` where it cannot be reached.

    clock: virtual time in chip clocks; branch: its number, the one that is shown unless given
    """

    clock: float
    branch: int | None = None


class LeavePast(Call, tag="leave_past"):
    """Show the present again."""


class GoOn(Call, tag="go_on"):
    """Make the past moment that is shown the present one, in a new branch; `hold` with time standing still."""

    hold: bool = False


class ReadMarks(Call, tag="read_marks"):
    """What happened in a branch of the history."""

    branch: int
    returns: ClassVar[Any] = Marks


class ReadWorld(Call, tag="read_world"):
    """What hangs on the module."""

    returns: ClassVar[Any] = World


class ReadEeprom(Call, tag="read_eeprom"):
    """The EEPROM of a virtual module."""

    returns: ClassVar[Any] = Eeprom


class ListPorts(Call, tag="list_ports"):
    """The ports of the server's computer; nothing is opened."""

    returns: ClassVar[Any] = Ports


class Scan(Call, tag="scan"):
    """Look for modules on ports, given as URLs; opens them and asks for versions, which changes no module.

    Goes on until it has looked everywhere, `StopScan`, or the end of the window; what it finds comes as events.
    """

    ports: list[str]
    far: bool = False
    """At all addresses, not only the lowest."""


class StopScan(Call, tag="stop_scan"):
    """Look no more."""


class Connect(Call, tag="connect"):
    """Go on with the module that a URL names, in all windows; what was begun on the present one is ended first.

    Refused with `port` for what pages may not open, `line` when it cannot be opened, and `silent` when the module does
    not answer, unless `anyway`.
    """

    url: str
    anyway: bool = False


class UseVirtual(Call, tag="use_virtual"):
    """Go on with a virtual module, in all windows.

    model: 0 is that of the last virtual module
    bench: path of its bench file; empty for bare motors
    text: stands before the file on disk
    keep: with the memory of the last virtual module of this model: its program and stored settings
    """

    model: Literal[0, 341, 342, 343] = 0
    bench: str = ""
    text: str = ""
    keep: bool = True


class CheckBench(Call, tag="check_bench"):
    """What is wrong with a text as a bench file."""

    path: str
    text: str
    returns: ClassVar[Any] = BenchCheck


class CompleteBench(Call, tag="complete_bench"):
    """What may stand at a place of a bench file; line and column from 1."""

    text: str
    line: int
    column: int
    returns: ClassVar[Any] = list[Suggestion]


class ListExamples(Call, tag="list_examples"):
    """The examples that came with the package."""

    returns: ClassVar[Any] = Examples


class ReadExample(Call, tag="read_example"):
    """The text of one file of the examples."""

    path: str
    returns: ClassVar[Any] = str


class ExportSettings(Call, tag="export_settings"):
    """All stored settings as text, for version control or for another module."""

    format: Literal["tmcl", "toml"]
    returns: ClassVar[Any] = str


class ImportSettings(Call, tag="import_settings"):
    """Set the parameters in a file of `export_settings`; what became of it.

    Refused with code `confirm` where the settings are of another model, unless `sure`.
    """

    file: bytes
    sure: bool = False
    returns: ClassVar[Any] = Imported


class Ping(Call, tag="ping"):
    """Nothing; the answer shows that the server lives."""


AnyCall = (
    ListFiles | ReadFile | WriteFile | RenameFile | DeleteFile
    | Assemble | Download | Upload | Adopt | Compare | ReadMap | Cover | ReadCoverage | ReadTracefile | ReadRegisters
    | ControlProgram | Execute | ExecuteText | SendAscii | ReadMany | Why
    | StopAll | Release | Arm | Dismiss | Abort | Zero | Search | Go | Turn | Profile | Keep | Jog | Stride
    | Watch | SetRate | FollowLog | SetBench | SetTime | StepTime | ReadWorld | ReadEeprom
    | ShowPast | LeavePast | GoOn | ReadMarks
    | CheckBench | CompleteBench | ListExamples | ReadExample
    | ExportSettings | ImportSettings | ListPorts | Scan | StopScan | Connect | UseVirtual | Ping
)  # fmt: skip
"""Everything a page may ask for."""

CALLS: Final[tuple[type[Call], ...]] = get_args(AnyCall)
Request = tuple[int, AnyCall]
"""A numbered call: what the page sends."""


# ------------------------------------------------------------------------------------------------ from the server


class Event(msgspec.Struct, tag_field="event"):
    """Something that the server says."""


class CallResult(Event, tag="answer"):
    """A call has been done."""

    id: int
    result: Any = None


class Refusal(Event, tag="refusal"):
    """A call could not be done: `text` is for people, `code` for the page."""

    id: int
    code: str
    text: str


class Fault(Event, tag="fault"):
    """The server has a bug, which a call has met: no answer and no refusal; the traceback is in the server's log.

    id: of the call, 0 where it was met elsewhere
    """

    id: int
    text: str


class Welcome(Event, tag="welcome"):
    """First message to a page."""

    protocol: int
    product: str
    start: str
    """Another text for each start of the server."""
    folder: str
    open: list[str]
    """Files to show at first."""
    source: Source
    module: str
    """Where the module is: a port, an address, or the bench's name."""
    model: ModelShape
    ability: Ability
    tables: Tables
    listing: Listing | None
    """The program that was last downloaded through this server."""
    links: list[str]
    """Kind and address of each line on which other hosts reach a virtual module."""
    window: int
    """This window's number, by which it knows its motions."""
    seat: int
    """Another number for each module that the server is connected to."""
    url: str
    """The line of a real module, as `Connect` takes it; empty for a virtual one."""
    named: bool
    """The server was started with a file or folder."""


class FilesChanged(Event, tag="files_changed"):
    """The folder's contents now."""

    files: list[FileEntry]


class Loaded(Event, tag="loaded"):
    """The module's program memory has a new program.

    by_other_host: it was stored by another host; its listing has the path of the text that makes it, or none
    """

    listing: Listing | None
    by_other_host: bool = False


class Progress(Event, tag="progress"):
    """A long call goes on; `done` equals `total` at its end."""

    title: str
    done: int
    total: int


class Authority(Event, tag="authority"):
    """Who moves what, and what is allowed."""

    real: bool
    """The module is a real one: it must be armed."""
    armed: bool
    """Motors may be set in motion."""
    latched: bool
    """STOP ALL holds until it is released."""
    doubts: list[Doubt]
    """What was commanded to stop and has not confirmed it."""
    motions: list[MotionShape]
    found: str
    """What was found when the module was first reached: motors that turn, or may; empty for nothing."""


class MotionEnded(Event, tag="motion_ended"):
    """A motion is over: `complete`, or before its time."""

    number: int
    kind: MotionKind
    complete: bool
    text: str


class ProfilePoint(Event, tag="profile_point"):
    """The load of a motor at one velocity: mean and standard deviation."""

    motor: int
    velocity: int
    mean: float
    deviation: float


class Telegrams(Event, tag="telegrams"):
    """New lines of the telegram log; `dropped` lines before them were not kept."""

    lines: list[Telegram]
    dropped: int


class Happened(Event, tag="happened"):
    """Something to mark in plots: a program event, a switch, a stall."""

    clock: float
    kind: str
    motor: int
    text: str


class History(Event, tag="history"):
    """How far the history of a virtual module reaches; the present branch is the last one."""

    memory: int
    """Used [bytes], of `limit`."""
    limit: int
    present: int
    """Number of the branch of the present."""
    now: float
    """The clock of the present."""
    shown: int
    """Number of the branch of the past moment that is shown; -1 for the present."""
    branches: list[Branch]


class WorldChanged(Event, tag="world_changed"):
    """The bench's settings now."""

    world: World


class Link(Event, tag="link"):
    """The connection to a real module came or went, or is another one: `place` is port, rate and address."""

    up: bool
    text: str
    place: str
    ascii: bool
    """The module speaks the ASCII interface: binary commands do not reach it."""


class ScanProgress(Event, tag="scan_progress"):
    """How far the scan of this window is: places done, all of them, and the present one."""

    done: int
    total: int
    place: str


class ScanFound(Event, tag="scan_found"):
    """A module that answered the scan."""

    url: str
    place: str
    model: int
    version: str


class ScanFailed(Event, tag="scan_failed"):
    """A port could not be looked at, and why."""

    text: str


class ScanEnded(Event, tag="scan_ended"):
    """The scan is over; not `complete` when it was stopped."""

    complete: bool


class Windows(Event, tag="windows"):
    """How many windows look at this module, with this one."""

    count: int


class Output(Event, tag="output"):
    """A line for people from the server."""

    severity: Severity
    text: str


AnyEvent = (
    CallResult | Refusal | Fault | Welcome | FilesChanged | Loaded | Progress
    | Telegrams | Happened | History | WorldChanged | Link | Windows | Output | Authority | MotionEnded | ProfilePoint
    | ScanProgress | ScanFound | ScanFailed | ScanEnded
)  # fmt: skip
"""Everything that the server may send as text."""

EVENTS: Final[tuple[type[Event], ...]] = get_args(AnyEvent)


class RefusalError(Exception):
    """A call that cannot be done; becomes a `Refusal` of one line."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(printable(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"))
        self.code = code


_LONGEST: Final = 400
"""Characters of a refusal; texts that pages send are quoted in it."""
