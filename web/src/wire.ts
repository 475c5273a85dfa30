// Written by `python -m tmcm34x.ide.typescript` from src/tmcm34x/ide/wire.py: change that, not this.

/** Bytes in base64. */
export type Base64 = string;

export const PROTOCOL = 5;
export const WATCH_BIT = 7;
export const MOTOR_FLAGS = { left: 1, right: 2, home: 4, reached: 8, left_off: 16, right_off: 32, energised: 64, stalled: 128 } as const;
export const TIME_FLAGS = { paused: 1, powered: 2, plugged: 4, past: 8, foreign: 16 } as const;
export const PROGRAM_FLAGS = { zero: 1, equal: 2, lower: 4, greater: 8, eto: 16, eal: 32, edv: 64, epo: 128, esd: 256, downloading: 512 } as const;
export const CURVES = ["position", "target", "speed", "target_speed", "load", "current", "encoder", "acceleration"] as const;

export interface TimeState {
    /** virtual time in chip clocks; wall time of the sample on a real module */
    clock: number;
    /** virtual seconds to a wall second, as reached */
    speed: number;
    /** virtual seconds to a wall second, as asked; 0 is as fast as possible */
    asked: number;
    /** bits of TIME_FLAGS */
    flags: number;
}

export const readTime = (view: DataView, at: number): TimeState => ({
    clock: view.getFloat64(at + 0, true),
    speed: view.getFloat32(at + 8, true),
    asked: view.getFloat32(at + 12, true),
    flags: view.getUint8(at + 16),
});

export interface ProgramState {
    /** 0 stop, 1 run, 2 step, 3 reset (parameter 128) */
    state: number;
    /** 1 while held by the debugger */
    paused: number;
    /** bits of PROGRAM_FLAGS */
    flags: number;
    /** address of the next instruction (parameter 130) */
    counter: number;
    /** open CSUB calls */
    depth: number;
    /** accumulator */
    accumulator: number;
    /** X register */
    x: number;
}

export const readProgram = (view: DataView, at: number): ProgramState => ({
    state: view.getUint8(at + 0),
    paused: view.getUint8(at + 1),
    flags: view.getUint16(at + 2, true),
    counter: view.getUint16(at + 4, true),
    depth: view.getUint8(at + 6),
    accumulator: view.getInt32(at + 7, true),
    x: view.getInt32(at + 11, true),
});

export interface MotorState {
    /** actual position [microsteps] */
    position: number;
    /** target position [microsteps] */
    target: number;
    /** actual speed [velocity units] */
    speed: number;
    /** target speed [velocity units] */
    target_speed: number;
    /** actual acceleration [acceleration units] */
    acceleration: number;
    /** encoder position [encoder steps] */
    encoder: number;
    /** bits of MOTOR_FLAGS */
    flags: number;
    /** load value 0..7 */
    load: number;
    /** driver error flags, axis parameter 208 */
    errors: number;
    /** coil current now [1/255 of the module's maximum] */
    current: number;
    /** ramp mode, axis parameter 138 */
    mode: number;
    /** reference search: state, 0 idle */
    search: number;
    /** microstep resolution, axis parameter 140 */
    resolution: number;
    /** pulse divisor, axis parameter 154 */
    pulse_div: number;
    /** ramp divisor, axis parameter 153 */
    ramp_div: number;
    /** rotor angle [rad], from the world where there is one, else from the position */
    angle: number;
    /** full steps lost since power-on; 0 without a world */
    slip: number;
    /** torque asked of the motor over what it has, 0..1; 0 without a world */
    strain: number;
    /** position of the load [mm or degrees]; 0 without a world */
    place: number;
}

export const readMotor = (view: DataView, at: number): MotorState => ({
    position: view.getInt32(at + 0, true),
    target: view.getInt32(at + 4, true),
    speed: view.getInt16(at + 8, true),
    target_speed: view.getInt16(at + 10, true),
    acceleration: view.getInt16(at + 12, true),
    encoder: view.getInt32(at + 14, true),
    flags: view.getUint16(at + 18, true),
    load: view.getUint8(at + 20),
    errors: view.getUint8(at + 21),
    current: view.getUint8(at + 22),
    mode: view.getUint8(at + 23),
    search: view.getUint8(at + 24),
    resolution: view.getUint8(at + 25),
    pulse_div: view.getUint8(at + 26),
    ramp_div: view.getUint8(at + 27),
    angle: view.getFloat32(at + 28, true),
    slip: view.getInt32(at + 32, true),
    strain: view.getFloat32(at + 36, true),
    place: view.getFloat32(at + 40, true),
});

export interface BoardState {
    /** digital inputs, bit 0 is input 0 */
    inputs: number;
    /** digital outputs */
    outputs: number;
    /** level of the SHUTDOWN pin */
    shutdown: number;
    /** analogue input 0, 0..1023 */
    analog0: number;
    /** analogue input 1, 0..1023 */
    analog1: number;
    /** analogue input 2, 0..1023 */
    analog2: number;
    /** analogue input 3, 0..1023 */
    analog3: number;
    /** analogue input 4, 0..1023 */
    analog4: number;
    /** analogue input 5, 0..1023 */
    analog5: number;
    /** analogue input 6, 0..1023 */
    analog6: number;
    /** analogue input 7, 0..1023 */
    analog7: number;
}

export const readBoard = (view: DataView, at: number): BoardState => ({
    inputs: view.getUint8(at + 0),
    outputs: view.getUint8(at + 1),
    shutdown: view.getUint8(at + 2),
    analog0: view.getUint16(at + 3, true),
    analog1: view.getUint16(at + 5, true),
    analog2: view.getUint16(at + 7, true),
    analog3: view.getUint16(at + 9, true),
    analog4: view.getUint16(at + 11, true),
    analog5: view.getUint16(at + 13, true),
    analog6: view.getUint16(at + 15, true),
    analog7: view.getUint16(at + 17, true),
});

export interface QualityState {
    /** unknown values of motor 0: bit n for row n of its group */
    motor0: number;
    /** unknown values of motor 1: bit n for row n of its group */
    motor1: number;
    /** unknown values of motor 2: bit n for row n of its group */
    motor2: number;
    /** unknown values of the program */
    program: number;
    /** unknown values of the board */
    board: number;
    /** when the module last sent a value [clocks of `time`]; -1 where all values are of now */
    seen: number;
}

export const readQuality = (view: DataView, at: number): QualityState => ({
    motor0: view.getUint32(at + 0, true),
    motor1: view.getUint32(at + 4, true),
    motor2: view.getUint32(at + 8, true),
    program: view.getUint16(at + 12, true),
    board: view.getUint16(at + 14, true),
    seen: view.getFloat64(at + 16, true),
});

export type GroupState = TimeState | ProgramState | MotorState | BoardState | QualityState;
export const GROUPS: readonly { name: string; size: number;
    read: (view: DataView, at: number) => GroupState }[] = [
    { name: "time", size: 17, read: readTime },
    { name: "program", size: 15, read: readProgram },
    { name: "motor0", size: 44, read: readMotor },
    { name: "motor1", size: 44, read: readMotor },
    { name: "motor2", size: 44, read: readMotor },
    { name: "board", size: 19, read: readBoard },
    { name: "quality", size: 24, read: readQuality },
];

/** Reads a state frame and gives each group in it to `take`; watched parameters go to `takeWatched`. */
export function readFrame(data: ArrayBuffer, take: (index: number, group: GroupState) => void,
    takeWatched: (values: (number | null)[]) => void): void {
    const view = new DataView(data);
    const mask = view.getUint8(0);
    let at = 1;
    for (let index = 0; index < GROUPS.length; index++) {
        if (!(mask & (1 << index))) continue;
        const group = GROUPS[index]!;
        take(index, group.read(view, at));
        at += group.size;
    }
    if (mask & (1 << WATCH_BIT)) {
        const values: (number | null)[] = [];
        const known = view.getUint8(at++);
        for (; at < data.byteLength; at += 4)
            values.push(known & (1 << values.length) ? view.getInt32(at, true) : null);
        takeWatched(values);
    }
}

export type Severity = "error" | "hint" | "information" | "warning";

/** One named value of a parameter. */
export interface Choice {
    value: number;
    text: string;
}

/** A row of the parameter tables; `bank` is -1 for an axis parameter. `kind` says what its value is, `group` under which title it is listed, `bits` what each bit stands for. */
export interface Parameter {
    bank: number;
    number: number;
    key: string;
    name: string;
    access: string;
    low: number;
    high: number;
    default: number;
    unit: string;
    meaning: string;
    section: string;
    choices: Choice[];
    kind: string;
    group: string;
    bits: string[];
    acts: boolean;
}

/** One operand of a command. */
export interface OperandShape {
    name: string;
    field: "motor" | "type" | "value";
    kind: string;
    low: number;
    high: number;
    words: Choice[];
    required: boolean;
}

/** A row of the command table. */
export interface CommandShape {
    number: number;
    mnemonic: string;
    syntax: string;
    title: string;
    meaning: string;
    section: string;
    where: string[];
    operands: OperandShape[];
}

/** What kind of module this is. */
export interface ModelShape {
    number: number;
    name: string;
    version: string;
    drivers: boolean;
    max_current_ma: number | null;
    shutdown_pin: number;
    known: boolean;
}

/** The vocabulary, as the firmware and the assembler read it. */
export interface Tables {
    commands: CommandShape[];
    control: CommandShape[];
    axis: Parameter[];
    globals: Parameter[];
    axis_groups: string[];
    global_groups: string[];
    statuses: Choice[];
    sister_commands: string[];
    functions: string[];
    clock_hz: number;
    program_size: number;
    coordinates: number;
    stack_depth: number;
}

/** What the page may offer with this module. */
export interface Ability {
    bench: boolean;
    debug: boolean;
    peek: boolean;
    language_server: boolean;
    history: boolean;
    irreversible: string;
}

/** A file or folder below the opened one; `stamp` changes with its contents. */
export interface FileEntry {
    path: string;
    folder: boolean;
    size: number;
    stamp: string;
}

/** A file's text; `newline` is how it ends its lines. */
export interface FileText {
    path: string;
    text: string;
    stamp: string;
    newline: "\n" | "\r\n";
}

/** A place in a source file, from 1. */
export interface SourceRange {
    path: string;
    line: number;
    column: number;
    end_line: number;
    end_column: number;
}

/** A motor that has not confirmed rest, and why; motor -1 is the program that has not confirmed its stop. */
export interface Doubt {
    motor: number;
    why: string;
}

/** Something that the server does for a window in more than one command. */
export interface MotionShape {
    number: number;
    kind: "go" | "jog" | "profile" | "restore" | "search" | "store" | "turn" | "zero";
    motors: number[];
    window: number;
}

/** Why a motor does not turn, and values without which a reason may be missing. */
export interface Reasons {
    reasons: string[];
    unknown: string[];
}

/** A diagnostic. */
export interface Problem {
    place: SourceRange;
    severity: "error" | "hint" | "information" | "warning";
    code: string;
    text: string;
}

/** One instruction of an assembled program and where it comes from; line 0 is nowhere. */
export interface ListingLine {
    address: number;
    path: string;
    line: number;
    record: string;
    text: string;
}

/** A label or constant. */
export interface SymbolShape {
    name: string;
    kind: "constant" | "label";
    value: string;
}

/** An assembled program; `identity` is the same for the same instructions. */
export interface Listing {
    path: string;
    identity: string;
    lines: ListingLine[];
    symbols: SymbolShape[];
}

/** What the assembler says; `listing` is missing when there are errors. lines: for each address the line of the assembled file that it comes from, 0 where that is another file */
export interface Assembled {
    problems: Problem[];
    listing: Listing | null;
    lines: number[];
}

/** A serial port of the server's computer. */
export interface PortShape {
    device: string;
    description: string;
}

/** Where modules may be: serial ports, and the CAN interfaces that python-can knows. */
export interface Ports {
    serial: PortShape[];
    can: string[];
    closed: string;
}

/** How a program is assembled. model: the module that it is for, 341, 342 or 343; 0 is the one at hand append_stop: put a STOP at its end, as the TMCL-IDE does */
export interface BuildOptions {
    model: number;
    append_stop: boolean;
}

/** A line of a source. */
export interface Site {
    path: string;
    line: number;
}

/** An entry point or subroutine of a program. calls: the names of the routines that it calls itself longest: instructions of the longest way without a WAIT, None where a loop has none; `ms` is their time */
export interface RoutineShape {
    name: string;
    path: string;
    line: number;
    instructions: number;
    calls: string[];
    longest: number | null;
    ms: number | null;
}

/** A user variable of a program, and the lines that write and read it. */
export interface VariableShape {
    number: number;
    writers: Site[];
    readers: Site[];
}

/** A label: the line of its instruction, and its address. */
export interface LabelShape {
    name: string;
    path: string;
    line: number;
    address: number;
}

/** The flow of a program: routines, the greatest number of calls open at once, user variables, labels. */
export interface FlowMap {
    path: string;
    instructions: number;
    stack: number;
    routines: RoutineShape[];
    variables: VariableShape[];
    labels: LabelShape[];
}

/** How often the command of a line was executed; of a JC also how often it jumped. */
export interface CoveredLine {
    path: string;
    line: number;
    executed: number;
    jumped: number | null;
}

/** A line of a comparison; a number of -1 is no line on that side. */
export interface DiffRow {
    kind: "changed" | "gone" | "new" | "same";
    left: number;
    left_text: string;
    right: number;
    right_text: string;
}

/** Two texts side by side, and what each of them is. */
export interface Comparison {
    path: string;
    left: string;
    right: string;
    same: boolean;
    rows: DiffRow[];
}

/** Bits `high` to `low` of a register; `access` has R, W and C, cleared by writing ones. */
export interface FieldShape {
    name: string;
    high: number;
    low: number;
    access: string;
    value: number;
}

/** A register of a motion chip as it is now; `motor` is -1 for one that all motors of the chip share. */
export interface RegisterShape {
    chip: number;
    motor: number;
    name: string;
    index: number;
    value: number;
    section: string;
    fields: FieldShape[];
}

/** One command and its answer; status 0 is no answer in time. */
export interface Exchange {
    text: string;
    sent: string;
    received: string;
    status: number;
    value: number;
    meaning: string;
}

/** What became of settings that were set: how many there were, and those that the module refused. */
export interface Imported {
    count: number;
    refused: string[];
}

/** What is wrong with a file as a bench; not `bench` for a TOML file of another kind. */
export interface BenchCheck {
    bench: boolean;
    problems: Problem[];
}

/** What may stand at the cursor of a bench file; `text` takes the place of the word before it. */
export interface Suggestion {
    label: string;
    detail: string;
    meaning: string;
    text: string;
}

/** A program of the examples; `bench` is that of its machine, empty for bare motors. path, bench: names for `ReadExample`; `includes` are beside the program */
export interface ExampleShape {
    path: string;
    title: string;
    text: string;
    bench: string;
    includes: string[];
}

/** A bench of the examples. */
export interface BenchShape {
    path: string;
    title: string;
}

/** What came with the package. */
export interface Examples {
    programs: ExampleShape[];
    benches: BenchShape[];
}

/** A line of the telegram log. */
export interface Telegram {
    number: number;
    clock: number;
    link: string;
    direction: "in" | "out";
    data: string;
    text: string;
    status: number;
    request: number;
    latency: number;
}

/** A value to read: bank -1 is an axis parameter of `motor`, -2 a coordinate. */
export interface Watched {
    bank: number;
    number: number;
    motor: number;
}

/** Load positions from which to which a switch is pressed; None is no end. */
export interface Cam {
    side: "left" | "right";
    low: number | null;
    high: number | null;
}

/** What hangs on one motor: what the page cannot see in the chip. */
export interface AxisWorld {
    motor: string;
    load: number;
    faults: string[];
    left_held: boolean;
    right_held: boolean;
    unit: string;
    turn: number;
    fullsteps: number;
    low: number | null;
    high: number | null;
    cams: Cam[];
    name: string;
    shape: "belt" | "rail" | "shaft" | "turntable";
}

/** A driver fault that a bench can raise. */
export interface FaultKind {
    name: string;
    meaning: string;
}

/** The bench's settings that pages set and show. */
export interface World {
    axes: AxisWorld[];
    faults: FaultKind[];
    bench: string;
    inputs: number[];
    plane: number[];
}

/** One course of events in the history; clocks are virtual time in chip clocks. */
export interface Branch {
    number: number;
    parent: number;
    since: number;
    oldest: number;
    end: number;
    inputs: number;
}

/** Something that happened, as in `Happened`. */
export interface Mark {
    clock: number;
    kind: string;
    motor: number;
    text: string;
}

/** What happened in a branch from `oldest` to `end`; `telegrams` counts them in equal parts of that time. */
export interface Marks {
    oldest: number;
    end: number;
    telegrams: number[];
    marks: Mark[];
}

/** A value in the EEPROM; bank -1 is an axis parameter, -2 a coordinate. */
export interface StoredValue {
    bank: number;
    number: number;
    motor: number;
    value: number;
}

/** The module's EEPROM: the image in hexadecimal, and the settings in it. */
export interface Eeprom {
    image: string;
    values: StoredValue[];
    file: string;
}

/** All files below the opened folder. */
export interface ListFiles {
    call: "list_files";
}

/** The text of one file. */
export interface ReadFile {
    call: "read_file";
    path: string;
}

/** Save a text; refused with code `changed` when the file is no longer the one of `stamp`. An empty `stamp` is a new file, `*` overwrites whatever is there. */
export interface WriteFile {
    call: "write_file";
    path: string;
    text: string;
    stamp: string;
    newline?: "\n" | "\r\n";
}

/** Give a file another path; refused when that exists. */
export interface RenameFile {
    call: "rename_file";
    path: string;
    to: string;
}

/** Remove one file. */
export interface DeleteFile {
    call: "delete_file";
    path: string;
}

/** Assemble a file; `texts` are editor pages that stand before the files on disk. */
export interface Assemble {
    call: "assemble";
    path: string;
    texts?: Record<string, string>;
    options?: BuildOptions;
}

/** Assemble and, without errors, store the program in the module; then start it if asked. */
export interface Download {
    call: "download";
    path: string;
    texts?: Record<string, string>;
    run?: boolean;
    replace?: boolean;
    options?: BuildOptions;
}

/** Read the module's program memory and disassemble it. */
export interface Upload {
    call: "upload";
}

/** Say that a text is the module's program; true when it assembles to what the memory holds. */
export interface Adopt {
    call: "adopt";
    path: string;
    texts?: Record<string, string>;
    options?: BuildOptions;
}

/** Compare the text on screen with its file, or the program that it makes with the one in the module. A text that makes the module's program is its source from then on, as with `Adopt`. */
export interface Compare {
    call: "compare";
    path: string;
    against: "disk" | "module";
    texts?: Record<string, string>;
    options?: BuildOptions;
}

/** The flow of a program; null where it has errors or no instructions. */
export interface ReadMap {
    call: "read_map";
    path: string;
    texts?: Record<string, string>;
    options?: BuildOptions;
}

/** Count from now on how often a virtual module executes each command of its program, or no more. */
export interface Cover {
    call: "cover";
    on: boolean;
}

/** What has been counted; nothing while the program has no known source. */
export interface ReadCoverage {
    call: "read_coverage";
}

/** What an lcov tracefile counts, such as `tmcm34x run --coverage` writes. */
export interface ReadTracefile {
    call: "read_tracefile";
    file: Base64;
}

/** The registers of a virtual module's motion chips, read without acting on them. */
export interface ReadRegisters {
    call: "read_registers";
}

/** Run from the start, stop, or reset, as a host does; everything finer is the debugger's. */
export interface ControlProgram {
    call: "control_program";
    action: "reset" | "run" | "stop";
}

/** Send one command to the module and wait for the answer. Refused with code `confirm` and a summary when it cannot be undone, unless `sure`; with `disarmed` or `latched` when it would set a motor in motion and that is not allowed. */
export interface Execute {
    call: "execute";
    number: number;
    type?: number;
    motor?: number;
    value?: number;
    sure?: boolean;
}

/** Send one command, written as in a source file; refused as `Execute` is. */
export interface ExecuteText {
    call: "execute_text";
    line: string;
    sure?: boolean;
}

/** Send one line to the ASCII interface, address letter included; what came back. `BIN` leaves it. */
export interface SendAscii {
    call: "send_ascii";
    line: string;
}

/** Read axis parameters, global parameters or coordinates without log lines; null where refused. */
export interface ReadMany {
    call: "read_many";
    items: Watched[];
}

/** Why a motor does not turn: a line for each reason, the most likely first, and what the module did not say. Reads parameters over the line; nothing that acts. */
export interface Why {
    call: "why";
    motor: number;
}

/** Stop the program and all motors, along their ramps, before anything queued; holds until `Release`. `Authority` tells which motors have not confirmed rest. */
export interface StopAll {
    call: "stop_all";
}

/** Let STOP ALL go: motors may be set in motion again. */
export interface Release {
    call: "release";
}

/** Let motors of a real module be set in motion, or no more. */
export interface Arm {
    call: "arm";
    on: boolean;
}

/** A person has read what was found (`Authority.found`). */
export interface Dismiss {
    call: "dismiss";
}

/** End a motion; its motors are brought to rest. */
export interface Abort {
    call: "abort";
    number: number;
}

/** Stop a motor and call the place where it rests 0; the motion's number. */
export interface Zero {
    call: "zero";
    motor: number;
}

/** Do the reference search of one motor; the motion's number. */
export interface Search {
    call: "search";
    motor: number;
}

/** Move motors to a stored coordinate; the motion's number. */
export interface Go {
    call: "go";
    coordinate: number;
    motors: number[];
}

/** Turn a motor, as long as this window lives and says nothing else; negative is left; the motion's number. */
export interface Turn {
    call: "turn";
    motor: number;
    velocity: number;
}

/** Measure the load of a motor from velocity `low` to `high`; the motion's number. */
export interface Profile {
    call: "profile";
    motor: number;
    low: number;
    high: number;
    step: number;
}

/** Store parameters in the EEPROM, or restore them from it, one by one; the motion's number. Storing in a real module is refused with code `confirm` and a summary, unless `sure`. */
export interface Keep {
    call: "keep";
    action: "restore" | "store";
    items: Watched[];
    sure?: boolean;
}

/** Turn a motor until its page says 0, has said nothing for a second, or is gone; to be said again and again. */
export interface Jog {
    call: "jog";
    motor: number;
    velocity: number;
}

/** Move a motor by a step of an arrow [microsteps]; steps in quick succession add up. */
export interface Stride {
    call: "stride";
    motor: number;
    distance: number;
}

/** Parameters to be sent with this page's state frames. */
export interface Watch {
    call: "watch";
    items: Watched[];
}

/** State frames a second for this page; 0 while the page is hidden. */
export interface SetRate {
    call: "set_rate";
    hz: number;
}

/** Send this page the telegram log from now on, or no more; with the IDE's own polling or without. since: number of the last line that the page has had */
export interface FollowLog {
    call: "follow_log";
    on: boolean;
    polls?: boolean;
    since?: number;
}

/** Change something on the virtual bench. */
export interface SetBench {
    call: "set_bench";
    what: "analog" | "fault" | "input" | "left" | "line" | "load" | "power" | "right" | "shutdown" | "source";
    index: number;
    value: number;
    fault?: string;
}

/** Pace of virtual time: what is not given stays; `speed` 0 is as fast as possible. */
export interface SetTime {
    call: "set_time";
    paused?: boolean | null;
    speed?: number | null;
}

/** Let virtual time go on by so many milliseconds, and hold it. */
export interface StepTime {
    call: "step_time";
    ms: number;
}

/** What hangs on the module. */
export interface ReadWorld {
    call: "read_world";
}

/** The EEPROM of a virtual module. */
export interface ReadEeprom {
    call: "read_eeprom";
}

/** Show a moment of the history in all windows; refused with code `history` where it cannot be reached. clock: virtual time in chip clocks; branch: its number, the one that is shown unless given */
export interface ShowPast {
    call: "show_past";
    clock: number;
    branch?: number | null;
}

/** Show the present again. */
export interface LeavePast {
    call: "leave_past";
}

/** Make the past moment that is shown the present one, in a new branch; `hold` with time standing still. */
export interface GoOn {
    call: "go_on";
    hold?: boolean;
}

/** What happened in a branch of the history. */
export interface ReadMarks {
    call: "read_marks";
    branch: number;
}

/** What is wrong with a text as a bench file. */
export interface CheckBench {
    call: "check_bench";
    path: string;
    text: string;
}

/** What may stand at a place of a bench file; line and column from 1. */
export interface CompleteBench {
    call: "complete_bench";
    text: string;
    line: number;
    column: number;
}

/** The examples that came with the package. */
export interface ListExamples {
    call: "list_examples";
}

/** The text of one file of the examples. */
export interface ReadExample {
    call: "read_example";
    path: string;
}

/** All stored settings as text, for version control or for another module. */
export interface ExportSettings {
    call: "export_settings";
    format: "tmcl" | "toml";
}

/** Set the parameters in a file of `export_settings`; what became of it. Refused with code `confirm` where the settings are of another model, unless `sure`. */
export interface ImportSettings {
    call: "import_settings";
    file: Base64;
    sure?: boolean;
}

/** The ports of the server's computer; nothing is opened. */
export interface ListPorts {
    call: "list_ports";
}

/** Look for modules on ports, given as URLs; opens them and asks for versions, which changes no module. Goes on until it has looked everywhere, `StopScan`, or the end of the window; what it finds comes as events. */
export interface Scan {
    call: "scan";
    ports: string[];
    far?: boolean;
}

/** Look no more. */
export interface StopScan {
    call: "stop_scan";
}

/** Go on with the module that a URL names, in all windows; what was begun on the present one is ended first. Refused with `port` for what pages may not open, `line` when it cannot be opened, and `silent` when the module does not answer, unless `anyway`. */
export interface Connect {
    call: "connect";
    url: string;
    anyway?: boolean;
}

/** Go on with a virtual module, in all windows. model: 0 is that of the last virtual module bench: path of its bench file; empty for bare motors text: stands before the file on disk keep: with the memory of the last virtual module of this model: its program and stored settings */
export interface UseVirtual {
    call: "use_virtual";
    model?: 0 | 341 | 342 | 343;
    bench?: string;
    text?: string;
    keep?: boolean;
}

/** Nothing; the answer shows that the server lives. */
export interface Ping {
    call: "ping";
}

export type Call = ListFiles | ReadFile | WriteFile | RenameFile | DeleteFile | Assemble | Download | Upload | Adopt | Compare | ReadMap | Cover | ReadCoverage | ReadTracefile | ReadRegisters | ControlProgram | Execute | ExecuteText | SendAscii | ReadMany | Why | StopAll | Release | Arm | Dismiss | Abort | Zero | Search | Go | Turn | Profile | Keep | Jog | Stride | Watch | SetRate | FollowLog | SetBench | SetTime | StepTime | ReadWorld | ReadEeprom | ShowPast | LeavePast | GoOn | ReadMarks | CheckBench | CompleteBench | ListExamples | ReadExample | ExportSettings | ImportSettings | ListPorts | Scan | StopScan | Connect | UseVirtual | Ping;

/** The type of the answer's result, by call. */
export interface Results {
    list_files: FileEntry[];
    read_file: FileText;
    write_file: FileEntry;
    rename_file: null;
    delete_file: null;
    assemble: Assembled;
    download: Assembled;
    upload: string;
    adopt: boolean;
    compare: Comparison;
    read_map: FlowMap | null;
    cover: null;
    read_coverage: CoveredLine[];
    read_tracefile: CoveredLine[];
    read_registers: RegisterShape[];
    control_program: null;
    execute: Exchange;
    execute_text: Exchange;
    send_ascii: string;
    read_many: (number | null)[];
    why: Reasons;
    stop_all: null;
    release: null;
    arm: null;
    dismiss: null;
    abort: null;
    zero: number;
    search: number;
    go: number;
    turn: number;
    profile: number;
    keep: number;
    jog: null;
    stride: null;
    watch: null;
    set_rate: null;
    follow_log: null;
    set_bench: null;
    set_time: null;
    step_time: null;
    read_world: World;
    read_eeprom: Eeprom;
    show_past: null;
    leave_past: null;
    go_on: null;
    read_marks: Marks;
    check_bench: BenchCheck;
    complete_bench: Suggestion[];
    list_examples: Examples;
    read_example: string;
    export_settings: string;
    import_settings: Imported;
    list_ports: Ports;
    scan: null;
    stop_scan: null;
    connect: null;
    use_virtual: null;
    ping: null;
}

/** A call has been done. */
export interface CallResult {
    event: "answer";
    id: number;
    result: unknown;
}

/** A call could not be done: `text` is for people, `code` for the page. */
export interface Refusal {
    event: "refusal";
    id: number;
    code: string;
    text: string;
}

/** The server has a bug, which a call has met: no answer and no refusal; the traceback is in the server's log. id: of the call, 0 where it was met elsewhere */
export interface Fault {
    event: "fault";
    id: number;
    text: string;
}

/** First message to a page. */
export interface Welcome {
    event: "welcome";
    protocol: number;
    product: string;
    start: string;
    folder: string;
    open: string[];
    source: "can" | "serial" | "slcan" | "tcp" | "virtual";
    module: string;
    model: ModelShape;
    ability: Ability;
    tables: Tables;
    listing: Listing | null;
    links: string[];
    window: number;
    seat: number;
    url: string;
    named: boolean;
}

/** The folder's contents now. */
export interface FilesChanged {
    event: "files_changed";
    files: FileEntry[];
}

/** The module's program memory has a new program. by_other_host: it was stored by another host; its listing has the path of the text that makes it, or none */
export interface Loaded {
    event: "loaded";
    listing: Listing | null;
    by_other_host: boolean;
}

/** A long call goes on; `done` equals `total` at its end. */
export interface Progress {
    event: "progress";
    title: string;
    done: number;
    total: number;
}

/** New lines of the telegram log; `dropped` lines before them were not kept. */
export interface Telegrams {
    event: "telegrams";
    lines: Telegram[];
    dropped: number;
}

/** Something to mark in plots: a program event, a switch, a stall. */
export interface Happened {
    event: "happened";
    clock: number;
    kind: string;
    motor: number;
    text: string;
}

/** How far the history of a virtual module reaches; the present branch is the last one. */
export interface History {
    event: "history";
    memory: number;
    limit: number;
    present: number;
    now: number;
    shown: number;
    branches: Branch[];
}

/** The bench's settings now. */
export interface WorldChanged {
    event: "world_changed";
    world: World;
}

/** The connection to a real module came or went, or is another one: `place` is port, rate and address. */
export interface Link {
    event: "link";
    up: boolean;
    text: string;
    place: string;
    ascii: boolean;
}

/** How many windows look at this module, with this one. */
export interface Windows {
    event: "windows";
    count: number;
}

/** A line for people from the server. */
export interface Output {
    event: "output";
    severity: "error" | "hint" | "information" | "warning";
    text: string;
}

/** Who moves what, and what is allowed. */
export interface Authority {
    event: "authority";
    real: boolean;
    armed: boolean;
    latched: boolean;
    doubts: Doubt[];
    motions: MotionShape[];
    found: string;
}

/** A motion is over: `complete`, or before its time. */
export interface MotionEnded {
    event: "motion_ended";
    number: number;
    kind: "go" | "jog" | "profile" | "restore" | "search" | "store" | "turn" | "zero";
    complete: boolean;
    text: string;
}

/** The load of a motor at one velocity: mean and standard deviation. */
export interface ProfilePoint {
    event: "profile_point";
    motor: number;
    velocity: number;
    mean: number;
    deviation: number;
}

/** How far the scan of this window is: places done, all of them, and the present one. */
export interface ScanProgress {
    event: "scan_progress";
    done: number;
    total: number;
    place: string;
}

/** A module that answered the scan. */
export interface ScanFound {
    event: "scan_found";
    url: string;
    place: string;
    model: number;
    version: string;
}

/** A port could not be looked at, and why. */
export interface ScanFailed {
    event: "scan_failed";
    text: string;
}

/** The scan is over; not `complete` when it was stopped. */
export interface ScanEnded {
    event: "scan_ended";
    complete: boolean;
}

export type ServerEvent = CallResult | Refusal | Fault | Welcome | FilesChanged | Loaded | Progress | Telegrams | Happened | History | WorldChanged | Link | Windows | Output | Authority | MotionEnded | ProfilePoint | ScanProgress | ScanFound | ScanFailed | ScanEnded;
