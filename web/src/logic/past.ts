// The history of a virtual module: which moment is shown, moving along it, and going on from there.
import { computed, effect, signal } from "@preact/signals";
import { TIME_FLAGS } from "../wire";
import type { History, Marks, ServerEvent } from "../wire";
import { ask, forget, notify, onServerEvent, refusals, shownClock, tables, time } from "./app";
import { choose } from "./confirm";
import { stopReason, tell } from "./debugger";

export const history = signal<History | null>(null);
export const marks = signal<Marks | null>(null);
/** A past moment is shown. */
export const past = computed(() => (time.value.flags & TIME_FLAGS.past) !== 0);
export const hertz = (): number => tables.value.clock_hz;

onServerEvent((event: ServerEvent) => {
    if (event.event === "history") history.value = event;
    if (event.event === "welcome") history.value = marks.value = null;
});

/** The branch that is shown. */
export const branch = computed(() => {
    const shape = history.value;
    const number = !shape || shape.shown < 0 ? shape?.present : shape.shown;
    return shape?.branches.find(item => item.number === number) ?? null;
});
/** How far the branch that is shown reaches: the clock of the present, or where it was left. */
export const end = computed(() => {
    const shown = branch.value;
    if (!shown) return 0;
    if (shown.number !== history.value!.present) return shown.end;
    return past.value ? history.value!.now : shownClock.value;
});

let wanted: { clock: number; branch: number | null } | null = null;
let asking = false;
/** Show a moment; of many in a row the last one counts. */
export function show(clock: number, number: number | null = null): void {
    wanted = { clock, branch: number };
    stopReason.value = "";
    if (!asking) void follow();
}

async function follow(): Promise<void> {
    asking = true;
    while (wanted) {
        const moment = wanted;
        wanted = null;
        await ask({ call: "show_past", ...moment });
    }
    asking = false;
}

export const leave = (): Promise<unknown> => ask({ call: "leave_past" });
export const goOn = (hold: boolean): Promise<unknown> => ask({ call: "go_on", hold });

export async function readMarks(): Promise<void> {
    const shown = branch.peek();
    if (shown) marks.value = await ask({ call: "read_marks", branch: shown.number });
}

/** Go to the last write of a value, and say what it was. */
export async function whoWrote(expression: string): Promise<void> {
    const answer = await tell(`who wrote ${expression}`);
    if (answer) notify("information", `${expression}: ${answer}`, undefined, "who");
}

refusals.past = async () => {
    const answer = await choose(
        "A past moment is shown",
        "Nothing can be changed there. Continue from this moment in a new branch, with time held, or return to the present first?",
        [
            { id: "live", title: "Return to the present" },
            { id: "branch", title: "Continue from here", tone: "primary" },
        ],
    );
    if (answer) await (answer === "branch" ? goOn(true) : leave());
    return answer !== null;
};
refusals.history = text => {
    const oldest = branch.peek()?.oldest;
    const action = oldest === undefined ? undefined : { title: "Show the oldest moment", run: () => show(oldest) };
    notify("warning", text, action, "history");
    return Promise.resolve(false);
};
effect(() => {
    if (!past.value) forget("history");
});
