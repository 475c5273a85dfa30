// Coverage: how often each command was executed, of the live program or from a tracefile of `tmcm34x run --coverage`.
import { computed, effect, signal } from "@preact/signals";
import type { CoveredLine } from "../wire";
import { ask, can, connection, files, notify, online, onServerEvent } from "./app";
import { base64, pickFile } from "./pick";

/** The live program is counted. */
export const counting = signal(false);
const rows = signal<readonly CoveredLine[]>([]);
/** Where the counts come from; empty while there are none. */
export const coverageSource = signal("");
const READ_MS = 1000;

/** By path and line; null while nothing is shown. */
export const coverage = computed<ReadonlyMap<string, ReadonlyMap<number, CoveredLine>> | null>(() => {
    if (!coverageSource.value) return null;
    const paths = new Map<string, Map<number, CoveredLine>>();
    for (const row of rows.value) {
        const path = known(row.path);
        paths.set(path, (paths.get(path) ?? new Map<number, CoveredLine>()).set(row.line, row));
    }
    return paths;
});
export const coveredCount = computed(() => ({
    executed: rows.value.filter(row => row.executed > 0).length,
    total: rows.value.length,
}));

/** The file of the folder that a tracefile means: its paths may begin elsewhere. */
function known(path: string): string {
    const same = files.value.find(file => file.path === path);
    const found = same ?? files.value.find(file => path.endsWith(`/${file.path}`) || file.path.endsWith(`/${path}`));
    return found?.path ?? path;
}

export type Covered = "covered" | "half" | "missed";
/** How well a line is covered: a jump that went one way only covers half of it. */
export function covered({ executed, jumped }: CoveredLine): Covered {
    if (!executed) return "missed";
    return jumped === null || (jumped > 0 && jumped < executed) ? "covered" : "half";
}

const times = (count: number): string => (count === 1 ? "once" : `${count} times`);
export function coverageText(row: CoveredLine): string {
    if (!row.executed) return "never executed";
    const way = row.jumped === null ? "" : row.jumped ? `, jumped ${times(row.jumped)}` : ", never jumped";
    return `executed ${times(row.executed)}${row.jumped === row.executed ? ", always jumped" : way}`;
}

export async function toggleCounting(): Promise<void> {
    const on = !counting.value;
    if ((await ask({ call: "cover", on })) === null && !online.value) return;
    counting.value = on;
    coverageSource.value = on ? "live" : "";
    rows.value = [];
}

/** Take counts from a tracefile that a person chooses. */
export function pickTracefile(): void {
    pickFile(".info,.lcov,.txt", async file => {
        const found = await ask({ call: "read_tracefile", file: await base64(file) });
        if (!found) return;
        if (counting.value) await toggleCounting();
        rows.value = found;
        coverageSource.value = file.name;
        const { executed, total } = coveredCount.value;
        notify("information", `${file.name}: ${executed} of ${total} commands were executed.`);
    });
}

export async function hideCoverage(): Promise<void> {
    if (counting.value) await toggleCounting();
    coverageSource.value = "";
    rows.value = [];
}

async function read(): Promise<void> {
    const found = await connection.call({ call: "read_coverage" }).catch(() => null);
    if (found && counting.peek()) rows.value = found;
}

let timer = 0;
effect(() => {
    clearInterval(timer);
    if (!counting.value || !online.value || !can.value.bench) return;
    void read();
    timer = window.setInterval(() => document.hidden || void read(), READ_MS);
});
// Another module counts nothing yet.
onServerEvent(event => {
    if (event.event === "welcome" && counting.peek()) void hideCoverage();
});
