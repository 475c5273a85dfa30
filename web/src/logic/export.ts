// Samples as files for other programs.
import type { Samples } from "./samples";

export interface Curve {
    title: string;
    /** Of the samples. */
    column: number;
    /** Of a curve that is computed: a value for each sample. */
    values?: readonly (number | null | undefined)[];
}

/** The value of a curve in a sample; NaN for none. */
const valueAt = (samples: Samples, { column, values }: Curve, n: number): number =>
    values ? (values[n] ?? NaN) : samples.value(column, n);

/** One line a sample: time in seconds, then the curves. */
export function toCsv(samples: Samples, curves: readonly Curve[]): string {
    const quoted = (text: string) => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
    const lines = [["time_s", ...curves.map(curve => quoted(curve.title.replace(/ /g, "_")))].join(",")];
    for (let n = 0; n < samples.length; n++) {
        const values = curves.map(curve => {
            const value = valueAt(samples, curve, n);
            return Number.isFinite(value) ? String(value) : "";
        });
        lines.push([samples.time(n).toFixed(6), ...values].join(","));
    }
    return `${lines.join("\n")}\n`;
}

const identifier = (n: number): string =>
    (n >= 94 ? identifier(Math.floor(n / 94) - 1) : "") + String.fromCharCode(33 + (n % 94));

/** Value change dump, time unit one microsecond, each curve a signed 32-bit vector; marks are a string variable. */
export function toVcd(samples: Samples, curves: readonly Curve[]): string {
    const marks = identifier(curves.length);
    const lines = ["$timescale 1us $end", "$scope module tmcm34x $end"];
    for (const [n, { title }] of curves.entries())
        lines.push(`$var integer 32 ${identifier(n)} ${title.replace(/\W+/g, "_")} $end`);
    lines.push(`$var string 1 ${marks} events $end`, "$upscope $end", "$enddefinitions $end");
    const last: (number | null)[] = curves.map(() => null);
    let mark = 0;
    let stamp = -1;
    const at = (seconds: number) => {
        const now = Math.round(seconds * 1e6);
        if (now > stamp) lines.push(`#${(stamp = now)}`);
    };
    for (let n = 0; n < samples.length; n++) {
        for (; mark < samples.marks.length && samples.marks[mark]!.time <= samples.time(n); mark++) {
            at(samples.marks[mark]!.time);
            lines.push(`s${samples.marks[mark]!.text.replace(/\s+/g, "_")} ${marks}`);
        }
        curves.forEach((curve, index) => {
            const value = Math.round(valueAt(samples, curve, n));
            if (!Number.isFinite(value) || value === last[index]) return;
            at(samples.time(n));
            lines.push(`b${(value >>> 0).toString(2)} ${identifier(index)}`);
            last[index] = value;
        });
    }
    return `${lines.join("\n")}\n`;
}
