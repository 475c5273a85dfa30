// Values beside the source lines while the program is held or runs slowly: looked at without acting on the module.
// Those of a real module are read over its line, more seldom, and not where reading them does something in it.
import { computed, effect, signal } from "@preact/signals";
import { PROGRAM_FLAGS, type ListingLine, type Parameter, type Watched } from "../wire";
import {
    board,
    boardKnown,
    can,
    connection,
    halted,
    held,
    loaded,
    online,
    program,
    programKnown,
    reachable,
    tables,
    time,
} from "./app";
import { COORDINATE_BANK } from "./parameters";
import { remembered } from "./settings";
import { grouped } from "./units";

/** A person wants values beside the lines. */
export const liveOn = remembered("live-values", true);
/** A person wants the editor to follow the running line. */
export const followOn = remembered("follow-line", false);

/** Virtual seconds to a second below which a person can follow values. */
const SLOW = 0.2;
const LOOK_MS = 250;
/** Over a line, where each value takes a telegram. */
const LINE_LOOK_MS = 1000;
const AXIS_BANK = -1;

/** State of a program that goes on in single steps. */
const IN_STEPS = 2;

const slow = computed(() =>
    can.value.bench ? time.value.asked > 0 && time.value.asked <= SLOW : program.value.state === IN_STEPS,
);
/** Values are shown now. */
export const liveNow = computed(
    () =>
        liveOn.value &&
        (can.value.peek ? online.value : reachable.value) &&
        !!loaded.value &&
        (held.value || (halted.value ? program.value.counter > 0 : slow.value)),
);

interface Fields {
    mnemonic: string;
    type: number;
    motor: number;
    value: number;
}

function fieldsOf(record: string): Fields {
    const bytes = record.split(" ").map(byte => parseInt(byte, 16));
    const row = tables.peek().commands.find(command => command.number === bytes[0]);
    const value = (bytes[3]! << 24) | (bytes[4]! << 16) | (bytes[5]! << 8) | bytes[6]!;
    return { mnemonic: row?.mnemonic ?? "", type: bytes[1]!, motor: bytes[2]!, value };
}

const axis = (key: string): Parameter => tables.peek().axis.find(row => row.key === key)!;
const readable = (rows: Parameter[], bank: number, number: number): boolean =>
    rows.some(
        row => row.bank === bank && row.number === number && row.access.includes("R") && (can.peek().peek || !row.acts),
    );

const AXIS = /^(SAP|GAP|AAP|STAP|RSAP)$/;
const GLOBAL = /^(SGP|GGP|AGP|STGP|RSGP)$/;
const COORDINATE = /^(SCO|GCO|CCO|ACO)$/;
const SPEED = /^(ROR|ROL|MST)$/;
const POSITION = /^(MVP|RFS|WAIT)$/;
const COMPUTED = /^(CALC|CALCX|COMP)$/;
const TICKS = 0;

/** What an instruction is about: a value to read, and what stands before it. */
function subject({ mnemonic, type, motor }: Fields): { item: Watched; text: string } | null {
    const { axis: rows, globals } = tables.peek();
    if (AXIS.test(mnemonic) && readable(rows, AXIS_BANK, type))
        return { item: { bank: AXIS_BANK, number: type, motor }, text: "=" };
    if (GLOBAL.test(mnemonic) && readable(globals, motor, type))
        return { item: { bank: motor, number: type, motor: 0 }, text: "=" };
    if (COORDINATE.test(mnemonic) && motor < 3)
        return { item: { bank: COORDINATE_BANK, number: type, motor }, text: "=" };
    if (motor > 2 || (mnemonic === "WAIT" && type === TICKS)) return null;
    if (SPEED.test(mnemonic))
        return { item: { bank: AXIS_BANK, number: axis("actual_speed").number, motor }, text: "speed" };
    if (POSITION.test(mnemonic))
        return { item: { bank: AXIS_BANK, number: axis("actual_position").number, motor }, text: "position" };
    return null;
}

/** The parts of an instruction that need no reading: registers, flags, lines. */
function own({ mnemonic, type, motor }: Fields): string {
    const { accumulator, x, flags } = program.peek();
    if ((COMPUTED.test(mnemonic) || mnemonic === "JC") && !programKnown("accumulator")) return "";
    if (COMPUTED.test(mnemonic))
        return `accumulator ${grouped(accumulator)}${mnemonic === "CALCX" ? `, X ${grouped(x)}` : ""}`;
    if (mnemonic === "JC") {
        const set = Object.entries(PROGRAM_FLAGS).filter(([name, bit]) => name !== "downloading" && flags & bit);
        return set.length ? `flags ${set.map(([name]) => name).join(", ")}` : "no flag set";
    }
    const lines = motor === 2 ? "outputs" : motor === 0 ? "inputs" : null;
    if (!/^(SIO|GIO)$/.test(mnemonic) || !lines || type > 7 || !boardKnown(lines)) return "";
    return `= ${(board.peek()[lines] >> type) & 1}`;
}

/** Texts by path and line. */
export const liveValues = signal<ReadonlyMap<string, ReadonlyMap<number, string>>>(new Map());
/** Lines that a person sees, set by the editor: nothing else is read. */
export const visibleLines = signal<{ path: string; first: number; last: number }>({ path: "", first: 0, last: 0 });

const visible = ({ path, line }: ListingLine): boolean => {
    const { path: shown, first, last } = visibleLines.peek();
    return line > 0 && path === shown && line >= first && line <= last;
};

async function look(): Promise<void> {
    const rows = (loaded.peek()?.lines ?? []).filter(visible).map(line => ({ line, fields: fieldsOf(line.record) }));
    const asked = rows.flatMap(row => {
        const found = subject(row.fields);
        return found ? [{ ...row, ...found }] : [];
    });
    const values = asked.length
        ? await connection.call({ call: "read_many", items: asked.map(row => row.item) }).catch(() => null)
        : [];
    if (!liveNow.peek() || !values) return;
    const texts = new Map<number, string>();
    asked.forEach(({ line, text }, at) => {
        const value = values[at];
        if (value != null) texts.set(line.line, `${text} ${grouped(value)}`);
    });
    for (const { line, fields } of rows) {
        const text = own(fields);
        if (text) texts.set(line.line, text);
    }
    liveValues.value = new Map([[visibleLines.peek().path, texts]]);
}

let timer = 0;
/** Counts the reasons to look; a look under way ends when there is another one. */
let round = 0;
effect(() => {
    clearTimeout(timer);
    const mine = ++round;
    if (!liveNow.value) {
        if (liveValues.peek().size) liveValues.value = new Map();
        return;
    }
    void visibleLines.value;
    const pause = can.value.peek ? LOOK_MS : LINE_LOOK_MS;
    const again = async (): Promise<void> => {
        if (!document.hidden) await look();
        if (mine === round) timer = window.setTimeout(() => void again(), pause);
    };
    void again();
});
