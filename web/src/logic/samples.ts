// The plots' memory: a ring of samples with one column a curve, of constant size however long the page is open.

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
    constructor(readonly width: number, readonly capacity: number) {
        this.columns = Array.from({ length: width }, () => new Float64Array(capacity));
    }

    add(row: ArrayLike<number>): void {
        const last = this.length ? this.time(this.length - 1) : -Infinity;
        if (row[0]! < last) this.clear();
        const at = (this.start + this.length) % this.capacity;
        for (let n = 0; n < this.width; n++) this.columns[n]![at] = row[n] ?? NaN;
        if (this.length < this.capacity) this.length++;
        else this.start = (this.start + 1) % this.capacity;
        this.version++;
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

    /** Values of `column` from `first` to before `last`, thinned to every `stride`th sample. */
    slice(column: number, first: number, last: number, stride = 1): Float64Array {
        const result = new Float64Array(Math.max(0, Math.ceil((last - first) / stride)));
        for (let n = 0, index = first; index < last; n++, index += stride) result[n] = this.value(column, index);
        return result;
    }
}
