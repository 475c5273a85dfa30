// All parameters of the module as last read; kept fresh while a page that shows them is open.
import { computed, effect, signal } from "@preact/signals";
import type { Parameter, Watched } from "../wire";
import { connection, onServerEvent, online, reachable, tables, welcome } from "./app";

export interface Values {
    /** By parameter number: one value a motor; null where the module refuses. */
    axis: ReadonlyMap<number, (number | null)[]>;
    /** By `bank/number`. */
    globals: ReadonlyMap<string, number | null>;
    /** By coordinate: one value a motor. */
    coordinates: (number | null)[][];
}
const NONE: Values = { axis: new Map(), globals: new Map(), coordinates: [] };
export const parameters = signal(NONE);
export const axisValue = (row: Parameter, motor: number) => parameters.value.axis.get(row.number)?.[motor];
export const globalValue = (row: Parameter) => parameters.value.globals.get(`${row.bank}/${row.number}`);
/** When each value last changed under the reader's eyes, by `bank/number/motor`; for a short glow. */
export const touched = signal<ReadonlyMap<string, number>>(new Map());
/** Sections that some open page shows. */
export const wanted = signal<ReadonlySet<"axis" | "globals" | "variables" | "coordinates">>(new Set());
export const COORDINATE_BANK = -2;

export const keyOf = (bank: number, number: number, motor = 0): string => `${bank}/${number}/${motor}`;

/** Reading it does something in the module: it is read when a person asks for it.  The loads, driver flags and encoders
 * of the motors are shown in their cards anyway. */
export const onDemand = (row: Parameter): boolean => row.acts && row.bank >= 0 && !welcome.value?.ability.peek;

/** Rows of the tables of parameters that are on the screen, by `bank/number/0`; null where no table is open. */
function inView(): ReadonlySet<string | undefined> | null {
    const rows = [...document.querySelectorAll<HTMLElement>("[data-parameter]")];
    if (!rows.length) return null;
    const seen = rows.filter(row => {
        const { top, bottom } = row.getBoundingClientRect();
        return bottom > 0 && top < window.innerHeight;
    });
    return new Set(seen.map(row => row.dataset.parameter));
}

function items(): Watched[] {
    const list: Watched[] = [];
    const { axis, globals } = tables.value;
    const want = wanted.peek();
    const { axis: known, globals: knownGlobals } = parameters.peek();
    // Over a slow line the rows on the screen come first, so that they are never old.
    const view = welcome.value?.ability.peek ? null : inView();
    const due = (row: Parameter, read: boolean) =>
        row.access.includes("R") && !onDemand(row) && (!read || !view || view.has(keyOf(row.bank, row.number)));
    if (want.has("axis") || known.size === 0)
        for (const row of axis.filter(item => due(item, known.has(item.number))))
            for (let motor = 0; motor < 3; motor++) list.push({ bank: -1, number: row.number, motor });
    for (const row of globals)
        if (
            want.has(row.bank === 2 ? "variables" : "globals") &&
            due(row, knownGlobals.has(`${row.bank}/${row.number}`))
        )
            list.push({ bank: row.bank, number: row.number, motor: 0 });
    if (want.has("coordinates"))
        for (let number = 0; number < tables.value.coordinates; number++)
            for (let motor = 0; motor < 3; motor++) list.push({ bank: COORDINATE_BANK, number, motor });
    return list;
}

/** Read what is wanted now. */
export const refresh = (): Promise<void> => readNow(items());

/** Read what a person asks for. What was read before stays where no answer comes: a lost reply takes no draft away. */
export async function readNow(list: readonly Watched[]): Promise<void> {
    if (!reachable.value || !list.length) return;
    const values = await connection.call({ call: "read_many", items: [...list] }).catch(() => null);
    if (!values) return;
    const old = parameters.peek();
    const axis = new Map(old.axis);
    const globals = new Map(old.globals);
    const coordinates = old.coordinates.slice();
    const glow = new Map(touched.peek());
    const now = performance.now();
    list.forEach(({ bank, number, motor }, at) => {
        const read = values[at] ?? null;
        let value = read;
        let before: number | null | undefined;
        if (bank === -1) {
            const row = (axis.get(number) ?? []).slice();
            before = row[motor];
            row[motor] = value = read ?? before ?? null;
            axis.set(number, row);
        } else if (bank === COORDINATE_BANK) {
            const row = (coordinates[number] ?? []).slice();
            before = row[motor];
            row[motor] = value = read ?? before ?? null;
            coordinates[number] = row;
        } else {
            before = globals.get(`${bank}/${number}`);
            globals.set(`${bank}/${number}`, (value = read ?? before ?? null));
        }
        if (before !== undefined && before !== value) glow.set(keyOf(bank, number, motor), now);
    });
    for (const [key, at] of glow) if (now - at > 1500) glow.delete(key);
    touched.value = glow;
    parameters.value = { axis, globals, coordinates };
}

onServerEvent(event => {
    if (event.event === "motion_ended" && (event.kind === "restore" || event.kind === "search")) void refresh();
});

/** Between two readings: a change by another host is seen within 2 s. */
const PAUSE_MS = 500;
let timer = 0;
async function poll(): Promise<void> {
    if (!document.hidden) await refresh();
    timer = window.setTimeout(() => void poll(), PAUSE_MS);
}
const seat = computed(() => `${welcome.value?.start} ${welcome.value?.seat}`);
/** What another module has said is nothing about this one. */
effect(() => {
    void seat.value;
    parameters.value = NONE;
});
effect(() => {
    void wanted.value;
    void seat.value;
    if (!online.value) return;
    clearTimeout(timer);
    void poll();
});
