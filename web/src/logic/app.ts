// The page's state: what the server told, what the module does, and the notices on screen.
import { batch, computed, signal } from "@preact/signals";
import {
    GROUPS, MOTOR_FLAGS, PROTOCOL, TIME_FLAGS, readBoard, readFrame, readMotor, readProgram, readTime,
} from "../wire";
import type {
    BoardState, Call, Exchange, FileEntry, Listing, MotorState, Parameter, ProgramState, Results,
    ServerEvent, Severity, Telegram, TimeState, Watched, Welcome, World,
} from "../wire";
import { sure } from "./confirm";
import { Connection, RefusedError } from "./connection";
import { remembered } from "./settings";
import { Samples } from "./samples";

export const connection = new Connection("/wire");

// ------------------------------------------------------------------ what the server said
export const welcome = signal<Welcome | null>(null);
export const files = signal<FileEntry[]>([]);
export const loaded = signal<Listing | null>(null);
export const world = signal<World | null>(null);
export const progress = signal<{ title: string; done: number; total: number } | null>(null);
export const link = signal<{ up: boolean; text: string }>({ up: true, text: "" });
/** Windows that look at this module. */
export const windows = signal(1);

export const online = computed(() => connection.state.value === "open" && welcome.value !== null);
export const can = computed(
    () => welcome.value?.ability ?? { bench: false, debug: false, peek: false, language_server: false },
);
export const tables = computed(() => welcome.value!.tables);

// ------------------------------------------------------------------ live state of the module
const empty = new DataView(new ArrayBuffer(64));
export const time = signal<TimeState>(readTime(empty, 0));
export const program = signal<ProgramState>(readProgram(empty, 0));
export const motors = [0, 1, 2].map(() => signal<MotorState>(readMotor(empty, 0)));
/** The same for figures that people read: ten times a second is as fast as anybody can. */
export const figures = [0, 1, 2].map((motor) => signal<MotorState>(motors[motor]!.peek()));
export const shownSeconds = signal(0);
export const shownProgram = signal<ProgramState>(program.peek());
const READ_MS = 90;
let readAt = 0;

function showFigures(): void {
    const now = performance.now();
    const due = now - readAt >= READ_MS || timePaused.peek();
    if (due) {
        readAt = now;
        shownSeconds.value = clockSeconds.peek();
    }
    if (due || !running.peek()) shownProgram.value = program.peek();
    motors.forEach((motor, at) => {
        if (due || motor.peek().speed === 0) figures[at]!.value = motor.peek();
    });
}

export const board = signal<BoardState>(readBoard(empty, 0));
export const watched = signal<number[]>([]);
export const clockSeconds = computed(() => time.value.clock / (welcome.value?.tables.clock_hz ?? 16e6));
export const powered = computed(() => (time.value.flags & TIME_FLAGS.powered) !== 0);
export const timePaused = computed(() => (time.value.flags & TIME_FLAGS.paused) !== 0);
export const plugged = computed(() => (time.value.flags & TIME_FLAGS.plugged) !== 0);
/** The program is held by the debugger or does not run: its place may be shown as the current line. */
export const halted = computed(() => program.value.paused === 1 || program.value.state !== 1);
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
};

// ------------------------------------------------------------------ samples for the plots
/** Curves of a motor, in the order of the sample columns. */
export const MOTOR_CURVES = [
    "position", "target", "speed", "target_speed", "load", "current", "encoder", "acceleration",
] as const;
export const WATCH_SLOTS = 8;
export const samples = new Samples(1 + 3 * MOTOR_CURVES.length + 2 + WATCH_SLOTS, 36_000);
const row = new Float64Array(samples.width);
export const columnOf = (motor: number, curve: number): number => 1 + motor * MOTOR_CURVES.length + curve;
export const COUNTER_COLUMN = 1 + 3 * MOTOR_CURVES.length;
export const OUTPUT_COLUMN = COUNTER_COLUMN + 1;
export const WATCH_COLUMN = COUNTER_COLUMN + 2;
/** Called after each state frame: draws what is drawn by hand (dials, plots). */
export const frameListeners = new Set<() => void>();

function sample(): void {
    let at = 0;
    row[at++] = clockSeconds.peek();
    for (const motor of motors) {
        const state = motor.peek();
        for (const curve of MOTOR_CURVES) row[at++] = state[curve];
    }
    row[at++] = program.peek().counter;
    row[at++] = board.peek().outputs;
    const values = watched.peek();
    for (let n = 0; n < WATCH_SLOTS; n++) row[at++] = values[n] ?? NaN;
    if (!samples.length || row[0]! !== samples.time(samples.length - 1)) samples.add(row);
}

connection.onFrame = (data) => {
    batch(() => {
        readFrame(
            data,
            (index, group) => takers[GROUPS[index]!.name]!(group as never),
            (values) => (watched.value = values),
        );
        showFigures();
    });
    sample();
    for (const draw of frameListeners) draw();
};

// ------------------------------------------------------------------ telegram log
export const LOG_LINES = 5000;
export const telegrams = signal<Telegram[]>([]);
export const droppedTelegrams = signal(0);

/** Number of the last telegram that this page has had. */
export const lastTelegram = { value: 0 };

function addTelegrams(lines: Telegram[]): void {
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
    const others = notices.value.filter((notice) => notice.text !== text && (!key || notice.key !== key)).slice(-3);
    notices.value = [...others, { id, severity, text, action, key }];
    if (severity !== "error") setTimeout(() => dismiss(id), action ? 15000 : 6000);
}

export const dismiss = (id: number): void => {
    notices.value = notices.value.filter((notice) => notice.id !== id);
};

// ------------------------------------------------------------------ asking
/** Ask the server; a refusal becomes a notice and the answer null. */
export async function ask<C extends Call>(call: C): Promise<Results[C["call"]] | null> {
    try {
        return await connection.call(call);
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (error.code === "confirm") return (await sure(error.message)) ? ask({ ...call, sure: true }) : null;
        notify("error", error.message, undefined, error.code);
        return null;
    }
}

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
    if (exchange && exchange.status !== 100 && command.number !== NEVER_ANSWERED) notify("warning", `${exchange.text}: ${exchange.meaning}`);
    return exchange;
}

/** Send a command by its mnemonic. */
export const send = (mnemonic: string, type: number, motor: number, value = 0): Promise<Exchange | null> =>
    execute({ number: numberOf(mnemonic), type, motor, value });

export const numberOf = (mnemonic: string): number =>
    tables.value.commands.find((row) => row.mnemonic === mnemonic)!.number;

/** A parameter's row by its key, such as `max_speed`. */
export const axisParameter = (key: string): Parameter => tables.value.axis.find((row) => row.key === key)!;

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
const sendWatches = (): void => void connection.call({ call: "watch", items: watches.value }).catch(() => {});
export function setWatches(items: Watched[]): void {
    const before = watches.value;
    watches.value = items.slice(0, WATCH_SLOTS);
    samples.arrange(WATCH_COLUMN, Array.from({ length: WATCH_SLOTS }, (_, slot) => before.indexOf(watches.value[slot]!)));
    watched.value = [];
    sendWatches();
}

// ------------------------------------------------------------------ events
const eventListeners = new Set<(event: ServerEvent) => void>();
export const onServerEvent = (listener: (event: ServerEvent) => void): void => void eventListeners.add(listener);

connection.onEvent = (event) => {
    switch (event.event) {
        case "welcome":
            batch(() => welcomed(event));
            break;
        case "files_changed":
            files.value = event.files;
            break;
        case "loaded":
            loaded.value = event.listing;
            break;
        case "windows":
            windows.value = event.count;
            break;
        case "progress":
            progress.value = event.done >= event.total ? null : event;
            break;
        case "telegrams":
            addTelegrams(event.lines);
            droppedTelegrams.value += event.dropped;
            break;
        case "happened":
            samples.mark({
                time: event.clock / tables.value.clock_hz, text: event.text, motor: event.motor, kind: event.kind,
            });
            break;
        case "world_changed":
            world.value = event.world;
            break;
        case "link":
            link.value = { up: event.up, text: event.text };
            break;
        case "output":
            notify(event.severity, event.text);
            break;
    }
    for (const listener of eventListeners) listener(event);
};

function welcomed(event: Welcome): void {
    if (event.protocol !== PROTOCOL) {
        location.reload();
        return;
    }
    welcome.value = event;
    loaded.value = event.listing;
    progress.value = null;
    lastTelegram.value = 0;
    telegrams.value = [];
    document.title = `${event.model.name} · tmcm34x`;
    sendRate();
    if (watches.value.length) sendWatches();
    void connection.call({ call: "list_files" }).then((list) => (files.value = list));
    if (event.ability.bench) void connection.call({ call: "read_world" }).then((found) => (world.value = found));
}

/** Enough for dials and plots to look alive, and cheap. */
const FRAMES_HZ = 20;
/** A window in the background asks for few frames. */
const sendRate = (): void =>
    void connection.call({ call: "set_rate", hz: document.hidden ? 2 : FRAMES_HZ }).catch(() => {});
document.addEventListener("visibilitychange", () => online.value && sendRate());

export const flag = (motor: number, name: keyof typeof MOTOR_FLAGS): boolean =>
    (motors[motor]!.value.flags & MOTOR_FLAGS[name]) !== 0;
