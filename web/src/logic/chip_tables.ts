// Driver chain and microstep wave of the motion chip: 64 cells each, in sixteen long words of bank 0.
import { signal } from "@preact/signals";
import { ask, connection, execute, notify, numberOf, tables } from "./app";
import { choose } from "./confirm";

export type TableName = "driver_chain" | "microstep_table";
export const CELLS = 64;
const A_WORD = 4;
const MASK = 0x3f;

/** Signals of a chain cell by code (TMC429 datasheet 11.4.1). */
export const SIGNALS: readonly string[] = [
    ...[0, 1, 2, 3, 4, 5].map(bit => `DAC A ${bit}`),
    "phase A",
    "fast decay A",
    ...[0, 1, 2, 3, 4, 5].map(bit => `DAC B ${bit}`),
    "phase B",
    "fast decay B",
    "zero",
    "one",
    "direction",
    "step",
];
/** Bit of a cell that ends the datagram of a driver. */
export const CHAIN_END = 0x20;
const ONE = 0x11;

type Decay = "off" | "falling" | "on";
const DECAY_A: Record<Decay, number> = { off: 0x10, falling: 0x07, on: ONE };
const DECAY_B: Record<Decay, number> = { off: 0x10, falling: 0x0f, on: ONE };

/** The chain of three TMC236 or TMC246: mixed decay off, in the falling current, or always. */
export function tmc246Chain(decay: Decay): number[] {
    const driver = [DECAY_A[decay], 5, 4, 3, 2, 6, DECAY_B[decay], 13, 12, 11, 10, 14 | CHAIN_END];
    const chain = [...driver, ...driver, ...driver];
    return [...chain, ...Array<number>(CELLS - chain.length).fill(ONE)];
}

/** A quarter sine from `offset` to 63 (TMC429 datasheet 11.5). */
export const sine = (offset: number): number[] =>
    Array.from({ length: CELLS }, (_, at) =>
        Math.min(63, Math.floor(0.5 + offset + (64 - offset) * Math.sin((Math.PI / 2) * (at / CELLS)))),
    );

/** Coil current of one of 256 places of the wave: the sign is that of the half wave. */
export function coil(table: readonly number[], place: number): number {
    const at = place & 63;
    const quarter = (place >> 6) & 3;
    const size = table[quarter & 1 ? Math.min(63, 64 - at) : at] ?? 0;
    return quarter < 2 ? size : -size;
}

/** The cells as last read; null while they are not known. */
export const cells = signal<Record<TableName, number[] | null>>({ driver_chain: null, microstep_table: null });

const firstWord = (name: TableName): number => tables.peek().globals.find(row => row.key === `${name}_0`)!.number;

export async function readTable(name: TableName): Promise<void> {
    const first = firstWord(name);
    const items = Array.from({ length: CELLS / A_WORD }, (_, at) => ({ bank: 0, number: first + at, motor: 0 }));
    const words = await connection.call({ call: "read_many", items }).catch(() => null);
    const known = words?.every(word => word !== null) ? (words as number[]) : null;
    cells.value = { ...cells.peek(), [name]: known?.flatMap(unpack) ?? null };
}

const unpack = (word: number): number[] => [0, 8, 16, 24].map(shift => (word >>> shift) & MASK);
const pack = (four: readonly number[]): number => four.reduce((word, cell, at) => word | (cell << (8 * at)), 0);

/** Send the long words that differ, once a person has read what that may do; the table is read back. */
export async function writeTable(name: TableName, draft: readonly number[], title: string): Promise<void> {
    const before = cells.peek()[name];
    const words = Array.from({ length: CELLS / A_WORD }, (_, at) => at).filter(at =>
        [0, 1, 2, 3].some(cell => before?.[at * A_WORD + cell] !== draft[at * A_WORD + cell]),
    );
    if (!words.length) return notify("information", "Nothing differs from what the module has.");
    const text = `${words.length} long words go straight to the motion chip. The manual warns that wrong values damage the drivers.`;
    if ((await choose(title, text, [{ id: "apply", title: "Apply", tone: "danger" }])) !== "apply") return;
    for (const at of words) {
        const value = pack(draft.slice(at * A_WORD, at * A_WORD + A_WORD)) | 0;
        const call = {
            call: "execute",
            number: numberOf("SGP"),
            type: firstWord(name) + at,
            motor: 0,
            value,
            sure: true,
        } as const;
        const exchange = await ask(call);
        if (exchange?.status !== 100) {
            notify(
                "error",
                exchange ? `${exchange.text}: ${exchange.meaning}. The words before it are written.` : "Not written.",
            );
            break;
        }
    }
    await readTable(name);
    const now = cells.peek()[name];
    if (now?.every((cell, at) => cell === draft[at]))
        notify("information", "The chip has the new table; it lasts until power-off unless stored.");
}

/** STGP and RSGP of the first long word mean the whole table (manual 6.7.11). */
export async function keepTable(name: TableName, action: "STGP" | "RSGP"): Promise<void> {
    const exchange = await execute({ number: numberOf(action), type: firstWord(name), motor: 0 });
    if (exchange?.status === 100)
        notify(
            "information",
            action === "STGP" ? "The table is stored in the EEPROM." : "The stored table is in the chip.",
        );
    await readTable(name);
}
