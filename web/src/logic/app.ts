// The page's state: what the server has sent, what the module does, and the notices on screen.
import { batch, computed, signal } from "@preact/signals";
import {
    CURVES,
    GROUPS,
    MOTOR_FLAGS,
    TIME_FLAGS,
    readBoard,
    readFrame,
    readMotor,
    readProgram,
    readQuality,
    readTime,
} from "../wire";
import type {
    BoardState,
    Call,
    Exchange,
    FileEntry,
    Listing,
    MotorState,
    Parameter,
    ProgramState,
    QualityState,
    Results,
    ServerEvent,
    Severity,
    Telegram,
    TimeState,
    Watched,
    Welcome,
    World,
} from "../wire";
import { sure } from "./confirm";
import { Connection, RefusedError } from "./connection";
import { remembered } from "./settings";
import { HOLE, Samples } from "./samples";

export const connection = new Connection("/wire");

// ------------------------------------------------------------------ what the server said
export const welcome = signal<Welcome | null>(null);
export const files = signal<FileEntry[]>([]);
/** The program that the module holds, where it is known. */
export const listing = signal<Listing | null>(null);
/** At the past moment that is shown the module held another program. */
export const foreign = computed(() => (time.value.flags & TIME_FLAGS.foreign) !== 0);
/** The program that the module holds as it is shown, where it is known. */
export const loaded = computed(() => (foreign.value ? null : listing.value));
export const world = signal<World | null>(null);
export const progress = signal<{ title: string; done: number; total: number } | null>(null);
export const link = signal<{ up: boolean; text: string; place: string; ascii: boolean }>({
    up: true,
    text: "",
    place: "",
    ascii: false,
});
/** Windows that show this module. */
export const windows = signal(1);

export const online = computed(() => connection.state.value === "open" && welcome.value !== null);
/** The module can be reached too. */
export const reachable = computed(
    () => online.value && link.value.up && (!told.value || (powered.value && plugged.value)),
);
export const can = computed(
    () =>
        welcome.value?.ability ?? {
            bench: false,
            debug: false,
            peek: false,
            language_server: false,
            history: false,
            irreversible: "",
        },
);
export const tables = computed(() => welcome.value!.tables);

// ------------------------------------------------------------------ live state of the module
const empty = new DataView(new ArrayBuffer(64));
export const time = signal<TimeState>(readTime(empty, 0));
export const program = signal<ProgramState>(readProgram(empty, 0));
export const motors = [0, 1, 2].map(() => signal<MotorState>(readMotor(empty, 0)));
/** The same for figures that people read: ten times a second is as fast as a person can. */
export const figures = [0, 1, 2].map(motor => signal<MotorState>(motors[motor]!.peek()));
export const shownClock = signal(0);
export const shownProgram = signal<ProgramState>(program.peek());
const READ_MS = 90;
/** After so long without a frame the last one is shown. */
const REST_MS = 150;
let readAt = 0;
let resting = 0;

function showAllFigures(): void {
    readAt = performance.now();
    shownClock.value = time.peek().clock;
    shownProgram.value = program.peek();
    motors.forEach((motor, at) => {
        figures[at]!.value = motor.peek();
    });
}

function showFigures(): void {
    clearTimeout(resting);
    if (performance.now() - readAt >= READ_MS || timePaused.peek()) {
        showAllFigures();
        return;
    }
    resting = window.setTimeout(() => batch(showAllFigures), REST_MS);
    if (!running.peek()) shownProgram.value = program.peek();
    motors.forEach((motor, at) => {
        if (motor.peek().speed === 0) figures[at]!.value = motor.peek();
    });
}

export const board = signal<BoardState>(readBoard(empty, 0));
export const watched = signal<(number | null)[]>([]);

// ------------------------------------------------------------------ what is known, and since when
const ALL = 0xffffffff;
const nothing: QualityState = {
    ...readQuality(empty, 0),
    motor0: ALL,
    motor1: ALL,
    motor2: ALL,
    program: 0xffff,
    board: 0xffff,
    seen: 0,
};
const quality = signal<QualityState>(nothing);
/** Another module, or the same one begun anew: nothing is known of it. */
export const forgetQuality = (): void => void (quality.value = nothing);
/** Number of a value in its group, by name. */
const order = (state: object): Record<string, number> =>
    Object.fromEntries(Object.keys(state).map((name, at) => [name, at]));
const MOTOR_ROWS = order(readMotor(empty, 0));
const PROGRAM_ROWS = order(readProgram(empty, 0));
const BOARD_ROWS = order(readBoard(empty, 0));
const has = (unknown: number, row: number): boolean => ((unknown >>> row) & 1) === 0;
export const motorKnown = (motor: number, name: keyof MotorState): boolean =>
    has(quality.value[`motor${motor}` as "motor0"], MOTOR_ROWS[name]!);
export const programKnown = (name: keyof ProgramState): boolean => has(quality.value.program, PROGRAM_ROWS[name]!);
export const boardKnown = (name: keyof BoardState): boolean => has(quality.value.board, BOARD_ROWS[name]!);
/** Values of a real module are stale when it has sent none for so long [s]. */
const STALE_S = 1.5;
/** How old what is shown is, in whole seconds; 0 while it is fresh, null while there is nothing. */
export const age = computed<number | null>(() => {
    const { seen } = quality.value;
    if (seen < 0 && online.value) return 0;
    const seconds = inSeconds(time.value.clock - seen);
    if (seen === 0) return null;
    return online.value && link.value.up && seconds < STALE_S ? 0 : Math.max(1, Math.floor(seconds));
});
export const stale = computed(() => age.value !== 0);
const inSeconds = (clock: number): number => clock / (welcome.value?.tables.clock_hz ?? 16e6);
export const clockSeconds = computed(() => inSeconds(time.value.clock));
export const shownSeconds = computed(() => inSeconds(shownClock.value));
export const powered = computed(() => (time.value.flags & TIME_FLAGS.powered) !== 0);
/** A first frame has come. */
export const told = computed(() => time.value.clock > 0);
export const timePaused = computed(() => (time.value.flags & TIME_FLAGS.paused) !== 0);
export const plugged = computed(() => (time.value.flags & TIME_FLAGS.plugged) !== 0);
/** States of a program that goes on: by itself, or in single steps. */
const GOING = new Set([1, 2]);
/** The program is held by the debugger or does not run: its place may be shown as the current line. */
export const halted = computed(() => program.value.paused === 1 || !GOING.has(program.value.state));
/** The debugger holds the program where it may go on. */
export const held = computed(() => program.value.paused === 1);
export const running = computed(() => !halted.value);
/** A CSUB is open. */
export const inRoutine = computed(() => program.value.depth > 0);

const takers: Record<string, (group: never) => void> = {
    time: (group: TimeState) => (time.value = group),
    program: (group: ProgramState) => (program.value = group),
    motor0: (group: MotorState) => (motors[0]!.value = group),
    motor1: (group: MotorState) => (motors[1]!.value = group),
    motor2: (group: MotorState) => (motors[2]!.value = group),
    board: (group: BoardState) => (board.value = group),
    quality: (group: QualityState) => (quality.value = group),
};

// ------------------------------------------------------------------ samples for the plots
/** Curves of a motor, in the order of the sample columns. */
export const MOTOR_CURVES = CURVES;
export const WATCH_SLOTS = 8;
export const samples = new Samples(1 + 3 * MOTOR_CURVES.length + 2 + WATCH_SLOTS, 60_000);
const row = new Float64Array(samples.width);
export const columnOf = (motor: number, curve: number): number => 1 + motor * MOTOR_CURVES.length + curve;
export const COUNTER_COLUMN = 1 + 3 * MOTOR_CURVES.length;
export const OUTPUT_COLUMN = COUNTER_COLUMN + 1;
export const WATCH_COLUMN = COUNTER_COLUMN + 2;
/** Called after each state frame: draws what is drawn by hand (dials, plots). */
export const frameListeners = new Set<() => void>();

/** Take the rows of a message (src/tmcm34x/ide/sampling.py): a value, unknown, or not looked at for each column. */
function takeSamples(data: ArrayBuffer): void {
    const view = new DataView(data);
    const seconds = 1 / (welcome.peek()?.tables.clock_hz ?? 16e6);
    for (let at = 1; at < data.byteLength; ) {
        row[0] = view.getFloat64(at, true) * seconds;
        const looked = [view.getUint32(at + 8, true), view.getUint32(at + 12, true)];
        const known = [view.getUint32(at + 16, true), view.getUint32(at + 20, true)];
        at += 24;
        for (let column = 0; column < samples.width - 1; column++) {
            const word = column >> 5;
            const bit = 1 << (column & 31);
            if (!(looked[word]! & bit)) {
                row[column + 1] = HOLE;
                continue;
            }
            row[column + 1] = known[word]! & bit ? view.getInt32(at, true) : NaN;
            at += 4;
        }
        samples.add(row);
        for (const look of sampleListeners) look(row);
    }
}
/** Called with each row of samples. */
export const sampleListeners = new Set<(row: Float64Array) => void>();

connection.onFrame = data => {
    if (new Uint8Array(data, 0, 1)[0] === 0) return takeSamples(data);
    batch(() => {
        readFrame(
            data,
            (index, group) => takers[GROUPS[index]!.name]!(group as never),
            values => (watched.value = values),
        );
        showFigures();
    });
    for (const draw of frameListeners) draw();
};

// ------------------------------------------------------------------ telegram log
export const LOG_LINES = 5000;
export const telegrams = signal<Telegram[]>([]);
export const droppedTelegrams = signal(0);

/** Number of the last telegram that this page has had. */
export const lastTelegram = { value: 0 };

export function addTelegrams(lines: Telegram[]): void {
    lastTelegram.value = lines[lines.length - 1]?.number ?? lastTelegram.value;
    telegrams.value = telegrams.value.concat(lines).slice(-LOG_LINES);
}

// ------------------------------------------------------------------ notices
export interface Notice {
    id: number;
    severity: Severity;
    text: string;
    action?: { title: string; run: () => void };
    /** A later notice with the same key takes its place. */
    key?: string;
}
export const notices = signal<Notice[]>([]);
export const output = signal<{ severity: Severity; text: string; at: Date }[]>([]);
let noticeId = 0;

export function notify(severity: Severity, text: string, action?: Notice["action"], key = ""): void {
    output.value = [...output.value.slice(-499), { severity, text, at: new Date() }];
    const id = ++noticeId;
    const others = notices.value.filter(notice => notice.text !== text && (!key || notice.key !== key)).slice(-3);
    notices.value = [...others, { id, severity, text, action, key }];
    setTimeout(() => dismiss(id), severity === "error" ? 30000 : action ? 15000 : 6000);
}

export const dismiss = (id: number): void => {
    notices.value = notices.value.filter(notice => notice.id !== id);
};

/** Messages of these kinds have lost their cause. */
export const forget = (...keys: string[]): void => {
    const left = notices.peek().filter(notice => !keys.includes(notice.key ?? ""));
    if (left.length !== notices.peek().length) notices.value = left;
};

// ------------------------------------------------------------------ asking
/** Ask the server; a refusal becomes a notice and the answer null. */
export async function ask<C extends Call>(call: C): Promise<Results[C["call"]] | null> {
    try {
        return await connection.call(call);
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (error.code === "confirm") return (await sure(error.message)) ? ask({ ...call, sure: true }) : null;
        const refused = refusals[error.code];
        if (refused) return (await refused(error.message)) ? ask(call) : null;
        notify("error", error.message, undefined, error.code);
        return null;
    }
}
/** What is done about a refusal, by its code; true where the call is to be made again. */
export const refusals: Record<string, (text: string) => Promise<boolean>> = {};

export interface Command {
    number: number;
    type?: number;
    motor?: number;
    value?: number;
}
export const exchanges = signal<Exchange[]>([]);

/** Command 137 has no reply. */
const NEVER_ANSWERED = 137;

/** Send one command; anything but success becomes a notice. */
export async function execute(command: Command): Promise<Exchange | null> {
    const exchange = await ask({ call: "execute", ...command });
    if (exchange?.status === 100) forget("command");
    if (exchange && exchange.status !== 100 && command.number !== NEVER_ANSWERED)
        notify("warning", `${exchange.text}: ${exchange.meaning}`, undefined, "command");
    return exchange;
}

/** Send a command by its mnemonic. */
export const send = (mnemonic: string, type: number, motor: number, value = 0): Promise<Exchange | null> =>
    execute({ number: numberOf(mnemonic), type, motor, value });

export const numberOf = (mnemonic: string): number =>
    tables.value.commands.find(row => row.mnemonic === mnemonic)!.number;

/** A parameter's row by its key, such as `max_speed`. */
export const axisParameter = (key: string): Parameter => tables.value.axis.find(row => row.key === key)!;

export const setAxis = (key: string, motor: number, value: number): Promise<Exchange | null> =>
    send("SAP", axisParameter(key).number, motor, value);

export async function readAxis(key: string, motor: number): Promise<number | null> {
    const values = await ask({ call: "read_many", items: [{ bank: -1, number: axisParameter(key).number, motor }] });
    return values?.[0] ?? null;
}

export async function stopAll(): Promise<void> {
    try {
        await connection.call({ call: "stop_all" });
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        notify("error", error.message);
    }
}

// ------------------------------------------------------------------ watched parameters
export const watches = remembered<Watched[]>("watches", []);
export const sendWatches = (): void => void connection.call({ call: "watch", items: watches.value }).catch(() => {});
export function setWatches(items: Watched[]): void {
    const before = watches.value;
    watches.value = items.slice(0, WATCH_SLOTS);
    samples.arrange(
        WATCH_COLUMN,
        Array.from({ length: WATCH_SLOTS }, (_, slot) => before.indexOf(watches.value[slot]!)),
    );
    watched.value = [];
    sendWatches();
}

// ------------------------------------------------------------------ events
export const eventListeners = new Set<(event: ServerEvent) => void>();
export const onServerEvent = (listener: (event: ServerEvent) => void): void => void eventListeners.add(listener);

export const flag = (motor: number, name: keyof typeof MOTOR_FLAGS): boolean =>
    (motors[motor]!.value.flags & MOTOR_FLAGS[name]) !== 0;
