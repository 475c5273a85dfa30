// What a plot draws besides its curves: lanes with their scales and legends, marks of events, the pinned cursor.
import type uPlot from "uplot";
import { samples } from "../../logic/app";
import { ticks, type Lane } from "../../logic/lanes";
import { grouped } from "../../logic/units";
import { UNITS, css, newest, type ShownCurve } from "./curves";

export const GUTTER = 66;
const FONT = "11px system-ui";
/** Pixels between two labels of a scale, at least. */
const APART = 26;

const shown = (value: number): string =>
    Number.isInteger(value) ? grouped(value) : String(value).replace("-", "\u2212");

export function drawing(
    curves: readonly ShownCurve[],
    lanes: () => readonly Lane[],
    pinned: () => number | null,
): uPlot.Plugin {
    // Asked for once: a computed style costs more than all the drawing.
    const [muted, text, grid, edge, pinColour, ...motorColours] = [
        "--muted",
        "--text",
        "--grid",
        "--faint",
        "--accent",
        "--motor0",
        "--motor1",
        "--motor2",
    ].map(css);
    const line = (ctx: CanvasRenderingContext2D, x: number, y: number, toX: number, toY: number) => {
        ctx.beginPath();
        ctx.moveTo(x, y);
        ctx.lineTo(toX, toY);
        ctx.stroke();
    };

    function scaleOf(plot: uPlot, lane: Lane, index: number, count: number): void {
        const { ctx, bbox } = plot;
        const height = bbox.height / count;
        const top = bbox.top + height * index;
        ctx.strokeStyle = grid!;
        ctx.textAlign = "right";
        ctx.textBaseline = "middle";
        ctx.fillStyle = muted!;
        for (const value of ticks(
            lane.low,
            lane.high,
            Math.max(1, Math.floor(height / devicePixelRatio / APART) - 1),
        )) {
            const y = plot.valToPos(value, lane.scale, true);
            if (y < top + 6 * devicePixelRatio || y > top + height - 6 * devicePixelRatio) continue;
            line(ctx, bbox.left, y, bbox.left + bbox.width, y);
            ctx.fillText(shown(value), bbox.left - 6 * devicePixelRatio, y);
        }
        if (index) {
            ctx.strokeStyle = edge!;
            line(ctx, bbox.left - GUTTER * devicePixelRatio, top, bbox.left + bbox.width, top);
        }
    }

    /** The lane's meaning, and its curves with their lines and newest values. */
    function legendOf(plot: uPlot, lane: Lane, index: number, count: number): void {
        const { ctx, bbox } = plot;
        const y = bbox.top + (bbox.height * index) / count + 9 * devicePixelRatio;
        let x = bbox.left + 6 * devicePixelRatio;
        ctx.textAlign = "left";
        ctx.fillStyle = muted!;
        const title = UNITS[lane.scale] ? `${lane.scale} [${UNITS[lane.scale]}]` : lane.scale;
        ctx.fillText(title, x, y);
        x += ctx.measureText(title).width + 14 * devicePixelRatio;
        for (const curve of curves.filter(({ scale }) => scale === lane.scale)) {
            const value = newest(curve);
            const words = `${curve.title}${Number.isNaN(value) ? "" : ` ${shown(value)}`}`;
            const width = ctx.measureText(words).width + 30 * devicePixelRatio;
            if (x + width > bbox.left + bbox.width) break;
            ctx.strokeStyle = curve.colour;
            ctx.lineWidth = 2 * devicePixelRatio;
            ctx.setLineDash((curve.dash ?? []).map(part => part * devicePixelRatio));
            line(ctx, x, y, x + 18 * devicePixelRatio, y);
            ctx.setLineDash([]);
            ctx.lineWidth = devicePixelRatio;
            ctx.fillStyle = text!;
            ctx.fillText(words, x + 22 * devicePixelRatio, y);
            x += width + 4 * devicePixelRatio;
        }
    }

    function marks(plot: uPlot): void {
        const { ctx, bbox } = plot;
        const { min, max } = plot.scales.x!;
        let free = -Infinity;
        for (const mark of samples.marks) {
            if (mark.time < min! || mark.time > max!) continue;
            const x = plot.valToPos(mark.time, "x", true);
            ctx.strokeStyle = ctx.fillStyle = motorColours[mark.motor] ?? muted!;
            ctx.globalAlpha = 0.55;
            line(ctx, x, bbox.top, x, bbox.top + bbox.height);
            if (x < free) continue;
            ctx.globalAlpha = 0.9;
            ctx.fillText(mark.text, x + 4, bbox.top + bbox.height - 7 * devicePixelRatio);
            free = x + ctx.measureText(mark.text).width + 10;
        }
        ctx.globalAlpha = 1;
    }

    return {
        hooks: {
            drawAxes: plot => {
                plot.ctx.save();
                plot.ctx.font = FONT.replace("11", String(11 * devicePixelRatio));
                plot.ctx.lineWidth = devicePixelRatio;
                const all = lanes();
                for (const [index, lane] of all.entries()) scaleOf(plot, lane, index, all.length);
                plot.ctx.restore();
            },
            draw: plot => {
                const { ctx, bbox, scales } = plot;
                if (scales.x!.min == null) return;
                ctx.save();
                ctx.font = FONT.replace("11", String(10 * devicePixelRatio));
                ctx.textBaseline = "middle";
                ctx.lineWidth = devicePixelRatio;
                const all = lanes();
                for (const [index, lane] of all.entries()) legendOf(plot, lane, index, all.length);
                marks(plot);
                const pin = pinned();
                if (pin !== null) {
                    ctx.strokeStyle = pinColour!;
                    const x = plot.valToPos(pin, "x", true);
                    if (x >= bbox.left && x <= bbox.left + bbox.width)
                        line(ctx, x, bbox.top, x, bbox.top + bbox.height);
                }
                ctx.restore();
            },
        },
    };
}
