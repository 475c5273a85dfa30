// The path that a tool has travelled in a plane.  States say where it is, several times a second; between two of them
// samples of the positions that the module counts say how it got there, where no steps were lost meanwhile.

/** A state or a sample of both axes of a plane: X first. */
export type Pair = readonly [number, number];

export interface State {
    time: number;
    /** Of the loads. */
    places: Pair;
    /** As the module counts them [microsteps]. */
    positions: Pair;
    /** Load positions of a microstep. */
    units: Pair;
}

export interface Sample {
    time: number;
    positions: Pair;
}

/** Load positions by which two states may differ without lost steps. */
const NEAR = 0.01;
const NOWHERE: Pair = [NaN, NaN];

export class Trail {
    private times: number[] = [];
    private points: Pair[] = [];
    private last: State | null = null;

    constructor(readonly capacity = 4000) {}

    /** Take a state, and the samples since the state before. */
    add(state: State, samples: readonly Sample[]): void {
        const { last } = this;
        if (last && state.time < last.time) this.cut(state.time);
        const zero = origin(state);
        if (this.last && near(origin(this.last), zero))
            for (const sample of samples) this.addSample(sample, state, zero);
        this.push(state.time, state.places);
        this.last = state;
    }

    /** Forget what came after a time. */
    cut(time: number): void {
        const kept = this.times.findIndex(at => at > time);
        if (kept >= 0) {
            this.times.length = kept;
            this.points.length = kept;
        }
        this.last = null;
        this.push(time, NOWHERE);
    }

    clear(): void {
        this.times = [];
        this.points = [];
        this.last = null;
    }

    /** The points up to a time, oldest first; NaN is a gap. */
    *until(time: number): Generator<Pair> {
        for (let at = 0; at < this.times.length && this.times[at]! <= time; at++) yield this.points[at]!;
    }

    private addSample(sample: Sample, { time, units }: State, zero: Pair): void {
        if (sample.time <= this.last!.time || sample.time >= time) return;
        const { positions } = sample;
        this.push(sample.time, [zero[0] + positions[0] * units[0], zero[1] + positions[1] * units[1]]);
    }

    private push(time: number, point: Pair): void {
        const before = this.points.at(-1);
        if (before && before[0] === point[0] && before[1] === point[1]) return;
        this.times.push(time);
        this.points.push(point);
        if (this.times.length > this.capacity) {
            this.times.splice(0, this.capacity >> 2);
            this.points.splice(0, this.capacity >> 2);
        }
    }
}

/** Where the loads are when the module counts 0. */
const origin = ({ places, positions, units }: State): Pair => [
    places[0] - positions[0] * units[0],
    places[1] - positions[1] * units[1],
];

const near = (a: Pair, b: Pair): boolean => Math.abs(a[0] - b[0]) < NEAR && Math.abs(a[1] - b[1]) < NEAR;
