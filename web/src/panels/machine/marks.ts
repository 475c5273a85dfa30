// Coordinates that the module has stored (SCO, CCO), for the drawing to mark.
import { signal } from "@preact/signals";
import { ask, online, tables, welcome } from "../../logic/app";

const COORDINATES = -2;
const MOTORS = 3;

/** A stored coordinate of each motor [microsteps]; 0 is what one holds that was never set. */
export interface Mark {
    number: number;
    positions: number[];
}

export const marks = signal<Mark[]>([]);

/** Read all of them anew; a virtual module does not notice it. */
export async function readMarks(): Promise<void> {
    if (!online.peek() || !welcome.peek()) return;
    const numbers = Array.from({ length: tables.peek().coordinates }, (_, n) => n);
    const items = numbers.flatMap(number =>
        Array.from({ length: MOTORS }, (_, motor) => ({ bank: COORDINATES, number, motor })),
    );
    const values = await ask({ call: "read_many", items });
    if (!values) return;
    const read = numbers.map(number => ({
        number,
        positions: values.slice(number * MOTORS, (number + 1) * MOTORS).map(value => value ?? 0),
    }));
    marks.value = read.filter(mark => mark.positions.some(position => position !== 0));
}

/** Where a motor's coordinates are: `zero` is the load position of microstep 0, `unit` that of one microstep. */
export const placesOf = (all: Mark[], motor: number, zero: number, unit: number): { number: number; place: number }[] =>
    all
        .filter(mark => mark.positions[motor] !== 0)
        .map(mark => ({ number: mark.number, place: zero + mark.positions[motor]! * unit }));
