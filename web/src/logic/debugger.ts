// The debugger: a client of the Debug Adapter Protocol. All windows share one session with the module's program
// (src/tmcm34x/ide/debugger.py says what differs from an editor that has a session of its own).
import { effect, signal } from "@preact/signals";
import type { DebugProtocol as Dap } from "@vscode/debugprotocol";
import { can, notify, online, welcome } from "./app";
import { RefusedError } from "./connection";

/** A breakpoint at a source line; empty texts mean not set. */
export interface Breakpoint {
    path: string;
    line: number;
    /** Hold only when it is not 0. */
    condition: string;
    /** A number of hits, perhaps after a comparison. */
    hits: string;
    /** Tell this instead of holding. */
    log: string;
}

/** A value whose changes hold the program; empty texts mean not set. */
export interface DataBreakpoint {
    value: string;
    condition: string;
    hits: string;
    /** Why it does not hold. */
    fault: string;
}

export interface Frame {
    name: string;
    address: number;
    path: string;
    line: number;
}

export const breakpoints = signal<Breakpoint[]>([]);
export const dataBreakpoints = signal<DataBreakpoint[]>([]);
/** What the debugger can hold at besides breakpoints, and which of it is chosen. */
export const breaks = signal<Dap.ExceptionBreakpointsFilter[]>([]);
export const chosenBreaks = signal<readonly string[]>([]);
export const stopReason = signal("");
/** What became of breakpoints, by `place`. */
const placed = signal<ReadonlyMap<string, Dap.Breakpoint>>(new Map());
const place = (path: string, line: number): string => `${path}:${line}`;
/** Where a breakpoint came to lie, or why nowhere. */
export const placeOf = (point: { path: string; line: number }): Dap.Breakpoint | undefined =>
    placed.value.get(place(point.path, point.line));

/** How often breakpoints were met with their conditions true, by their number. */
const hits = signal<ReadonlyMap<number, number>>(new Map());
/** The same of one breakpoint; undefined while the program has no place for it. */
export const hitsOf = (point: { path: string; line: number }): number | undefined => {
    const id = placeOf(point)?.id;
    return id === undefined ? undefined : hits.value.get(id);
};

// ------------------------------------------------------------------ messages
interface Waiting {
    resolve: (body: never) => void;
    reject: (error: Error) => void;
}

let socket: WebSocket | null = null;
let seq = 0;
const waiting = new Map<number, Waiting>();
const connecting = signal(false);

function request<R extends Dap.Response>(command: string, args: object = {}): Promise<R["body"]> {
    if (socket?.readyState !== WebSocket.OPEN)
        return Promise.reject(new RefusedError("offline", "The debugger is not connected."));
    const message: Dap.Request = { seq: ++seq, type: "request", command, arguments: args };
    socket.send(JSON.stringify(message));
    return new Promise((resolve, reject) => waiting.set(message.seq, { resolve, reject }));
}

function take(message: Dap.ProtocolMessage): void {
    if (message.type === "response") {
        const response = message as Dap.Response;
        const asker = waiting.get(response.request_seq);
        waiting.delete(response.request_seq);
        if (response.success) asker?.resolve(response.body as never);
        else asker?.reject(new RefusedError("debugger", response.message ?? "The debugger refused."));
    } else if (message.type === "event") {
        const { event, body } = message as Dap.Event;
        takers[event]?.(body as never);
    }
}

const takers: Record<string, (body: never) => void> = {
    stopped: ({ reason, description, text }: Dap.StoppedEvent["body"]) => {
        stopReason.value = reason === "exception" ? description! : reason;
        if (!text) return;
        if (reason === "entry" || reason === "pause") notify("information", `${sentence(text)}.`, undefined, "who");
        if (reason === "exception" || reason === "data breakpoint")
            notify(reason === "exception" ? "warning" : "information", `Held: ${text}`, undefined, "held");
    },
    // Log points may be passed often: they have one notice, and their lines are in the list of messages.
    output: ({ category, output, line }: Dap.OutputEvent["body"]) =>
        notify(
            category === "stderr" ? "error" : "information",
            output.trimEnd(),
            undefined,
            line === undefined ? "" : "log",
        ),
    breakpoint: ({ breakpoint }: Dap.BreakpointEvent["body"]) => {
        const moved = [...placed.value].find(([, known]) => known.id === breakpoint.id);
        if (moved) placed.value = new Map(placed.value).set(moved[0], breakpoint);
    },
    tmcl_breakpoints: (body: { source: Dap.Source; breakpoints: Dap.SourceBreakpoint[]; placed: Dap.Breakpoint[] }) => {
        const path = relative(body.source.path);
        const here = body.breakpoints.map(
            (point): Breakpoint => ({
                path,
                line: point.line,
                condition: point.condition ?? "",
                hits: point.hitCondition ?? "",
                log: point.logMessage ?? "",
            }),
        );
        breakpoints.value = [...breakpoints.value.filter(point => point.path !== path), ...here];
        keep(path, here, body.placed);
    },
    tmcl_data_breakpoints: (body: { breakpoints: Dap.DataBreakpoint[]; placed: Dap.Breakpoint[] }) =>
        (dataBreakpoints.value = body.breakpoints.map(({ dataId, condition = "", hitCondition = "" }, at) => ({
            value: dataId,
            condition,
            hits: hitCondition,
            fault: body.placed[at]?.message ?? "",
        }))),
    tmcl_hits: (body: { hits: Record<string, number> }) =>
        (hits.value = new Map(Object.entries(body.hits).map(([id, count]) => [Number(id), count]))),
    tmcl_filters: (body: { filters: string[] }) => (chosenBreaks.value = body.filters),
};

// ------------------------------------------------------------------ breakpoints

function keep(path: string, points: Breakpoint[], answers: Dap.Breakpoint[]): void {
    const others = [...placed.value].filter(([key]) => !key.startsWith(`${path}:`));
    placed.value = new Map([...others, ...points.map((point, at) => [place(path, point.line), answers[at]!] as const)]);
}

/** Have these instead of the present ones. */
export async function setBreakpoints(list: Breakpoint[]): Promise<void> {
    const before = breakpoints.value;
    breakpoints.value = list;
    await Promise.all([...new Set([...before, ...list].map(point => point.path))].map(sendBreakpoints));
}

let carryTimer = 0;
/** Breakpoints of a file have moved with their lines, or gone with them. */
export function carryBreakpoints(path: string, points: Breakpoint[]): void {
    breakpoints.value = [...breakpoints.value.filter(point => point.path !== path), ...points];
    clearTimeout(carryTimer);
    carryTimer = window.setTimeout(() => void sendBreakpoints(path), 400);
}

const sentence = (text: string): string => text[0]!.toUpperCase() + text.slice(1);

async function sendBreakpoints(path: string): Promise<void> {
    const here = breakpoints.value.filter(point => point.path === path);
    const wanted = here.map(
        (point): Dap.SourceBreakpoint => ({
            line: point.line,
            condition: point.condition,
            hitCondition: point.hits,
            logMessage: point.log,
        }),
    );
    const answer = await attempt<Dap.SetBreakpointsResponse>("setBreakpoints", {
        source: { path },
        breakpoints: wanted,
    });
    if (!answer) return;
    keep(path, here, answer.breakpoints);
    const noted = answer.breakpoints.find(point => point.verified && point.message);
    if (noted)
        notify(can.value.debug ? "warning" : "information", `${sentence(noted.message!)}.`, undefined, "breakpoint");
}

/** Have these instead of the present ones. */
export async function setDataBreakpoints(list: DataBreakpoint[]): Promise<void> {
    const breakpoints = list.map(
        ({ value, condition, hits }): Dap.DataBreakpoint => ({ dataId: value, condition, hitCondition: hits }),
    );
    const answer = await attempt<Dap.SetDataBreakpointsResponse>("setDataBreakpoints", { breakpoints });
    if (answer)
        dataBreakpoints.value = list.map((item, at) => ({ ...item, fault: answer.breakpoints[at]?.message ?? "" }));
}

/** One more, in place of that of the same value; whether the value can be watched: a notice says why not. */
export async function addDataBreakpoint(item: DataBreakpoint): Promise<boolean> {
    const found = await attempt<Dap.DataBreakpointInfoResponse>("dataBreakpointInfo", { name: item.value });
    if (!found?.dataId) {
        if (found) notify("error", `${item.value} cannot hold the program: ${found.description}.`);
        return false;
    }
    await setDataBreakpoints([...dataBreakpoints.value.filter(({ value }) => value !== item.value), item]);
    return true;
}

export async function chooseBreak(key: string, on: boolean): Promise<void> {
    const others = chosenBreaks.value.filter(other => other !== key);
    chosenBreaks.value = on ? [...others, key] : others;
    await attempt("setExceptionBreakpoints", { filters: chosenBreaks.value });
}

// ------------------------------------------------------------------ going on, looking, changing
/** Ask the debugger; a refusal becomes a notice and the answer null. */
async function attempt<R extends Dap.Response>(command: string, args: object = {}): Promise<R["body"] | null> {
    try {
        return (await request<R>(command, args)) ?? {};
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (error.code !== "offline" || online.value) notify("error", `${error.message.replace(/\.$/, "")}.`);
        return null;
    }
}

/** What the debug console answers; null where it refuses. */
export const tell = async (expression: string): Promise<string | null> =>
    (await attempt<Dap.EvaluateResponse>("evaluate", { expression, context: "repl" }))?.result ?? null;

type Going = "continue" | "pause" | "next" | "stepIn" | "stepOut" | "stepBack" | "reverseContinue";
export const go = (command: Going): Promise<unknown> => attempt(command, { threadId: 1 });

/** The open routines, the innermost first. */
export async function readStack(): Promise<Frame[]> {
    const answer = await attempt<Dap.StackTraceResponse>("stackTrace", { threadId: 1 });
    return (answer?.stackFrames ?? []).map(frame => ({
        name: frame.name,
        address: Number(frame.instructionPointerReference),
        path: relative(frame.source?.path),
        line: frame.line,
    }));
}

/** The value of an expression, or why it has none. */
export async function evaluate(expression: string): Promise<number | string> {
    try {
        return Number((await request<Dap.EvaluateResponse>("evaluate", { expression, context: "watch" })).result);
    } catch (error) {
        return (error as Error).message;
    }
}

export const assign = (expression: string, value: number | string): Promise<unknown> =>
    attempt("setExpression", { expression, value: String(value) });

/** A path of the protocol's below the opened folder. */
const relative = (path = ""): string => {
    const folder = `${welcome.value?.folder ?? ""}/`;
    return path.startsWith(folder) ? path.slice(folder.length) : path;
};

// ------------------------------------------------------------------ connection
async function greet(): Promise<void> {
    const [kept, keptData] = [breakpoints.value, dataBreakpoints.value];
    const client = { adapterID: "tmcl", clientID: "tmcm34x", pathFormat: "path" };
    const able = await request<Dap.InitializeResponse>("initialize", client);
    breaks.value = able?.exceptionBreakpointFilters ?? [];
    await request("attach");
    breakpoints.value = [];
    await request("configurationDone");
    await request("threads");
    if (!breakpoints.value.length && kept.length) await setBreakpoints(kept);
    if (!dataBreakpoints.value.length && keptData.length) await setDataBreakpoints(keptData);
}

effect(() => {
    if (!online.value || connecting.value) return;
    connecting.value = true;
    socket = new WebSocket(new URL("/dap", location.href.replace(/^http/, "ws")));
    socket.onmessage = ({ data }) => take(JSON.parse(String(data)) as Dap.ProtocolMessage);
    socket.onopen = () => void greet().catch(() => {});
    socket.onclose = () => {
        for (const asker of waiting.values()) asker.reject(new RefusedError("offline", "The debugger has ended."));
        waiting.clear();
        setTimeout(() => (connecting.value = false), 500);
    };
});
