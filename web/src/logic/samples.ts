// The plots' memory: a ring of samples with one column a curve, of constant size however long the page is open.

/** In a column that was not looked at when the row was taken: no gap, and no value. NaN is a gap. */
export const HOLE = -Infinity;

/** null is unknown, undefined not looked at. */
export type Value = number | null | undefined;

export interface Mark {
    time: number;
    text: string;
    motor: number;
    kind: string;
}

export class Samples {
    private readonly columns: Float64Array[];
    private start = 0;
    length = 0;
    readonly marks: Mark[] = [];
    /** Counts samples ever added; a plot redraws when it has moved. */
    version = 0;

    /** Column 0 is the time in seconds; it must not fall. */
    constructor(
        readonly width: number,
        readonly capacity: number,
    ) {
        this.columns = Array.from({ length: width }, () => new Float64Array(capacity));
    }

    add(row: ArrayLike<number>): void {
        const last = this.length ? this.time(this.length - 1) : -Infinity;
        if (row[0]! < last) this.goBack(row[0]!);
        const at = (this.start + this.length) % this.capacity;
        for (let n = 0; n < this.width; n++) this.columns[n]![at] = row[n] ?? NaN;
        if (this.length < this.capacity) this.length++;
        else this.start = (this.start + 1) % this.capacity;
        this.version++;
    }

    /** The module went on from a past moment: what came after that has not happened. */
    private goBack(time: number): void {
        this.length = this.find(time);
        this.marks.splice(0, this.marks.length, ...this.marks.filter(mark => mark.time <= time));
    }

    mark(mark: Mark): void {
        this.marks.push(mark);
        if (this.marks.length > 500) this.marks.splice(0, 100);
    }

    /** Columns from `first` on get the values of others: `from[n]` counts from `first`, -1 is no values. */
    arrange(first: number, from: number[]): void {
        const before = this.columns.slice(first, first + from.length);
        from.forEach((source, n) => {
            this.columns[first + n] = before[source] ?? new Float64Array(this.capacity).fill(NaN);
        });
        this.version++;
    }

    clear(): void {
        this.start = this.length = 0;
        this.marks.length = 0;
        this.version++;
    }

    time(index: number): number {
        return this.columns[0]![(this.start + index) % this.capacity]!;
    }

    value(column: number, index: number): number {
        return this.columns[column]![(this.start + index) % this.capacity]!;
    }

    /** Index of the first sample at or after `time`. */
    find(time: number): number {
        let low = 0;
        let high = this.length;
        while (low < high) {
            const middle = (low + high) >> 1;
            if (this.time(middle) < time) low = middle + 1;
            else high = middle;
        }
        return low;
    }

    /** Values of `column` from `first` to before `last` for a plot; undefined where none was looked at, null where it was
     * unknown. */
    slice(column: number, first: number, last: number): Value[] {
        const result: Value[] = [];
        for (let index = first; index < last; index++) {
            const value = this.value(column, index);
            result.push(value === HOLE ? undefined : Number.isNaN(value) ? null : value);
        }
        return result;
    }

    /** The last value of `column` up to `index`, NaN where it is unknown. */
    lastValue(column: number, index: number): number {
        for (let at = index; at >= 0; at--) {
            const value = this.value(column, at);
            if (value !== HOLE) return value;
        }
        return NaN;
    }
}
