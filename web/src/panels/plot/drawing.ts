// What a plot draws besides its curves: lanes with their scales and titles, marks of events, pinned cursors.
import type uPlot from "uplot";
import { samples } from "../../logic/app";
import { labels, type Lane } from "../../logic/lanes";
import { grouped } from "../../logic/units";
import { UNITS, css, type ShownCurve } from "./curves";

export const GUTTER = 66;
/** Pixels between a label and the end of its lane, at least. */
const EDGE = 6;
/** Height of a lane's title. */
export const TITLE_PX = 16;
const FONT = "11px system-ui";
/** Pixels between two labels of a scale, as wished and at least. */
const APART = 24;
const CLOSEST = 13;

const shown = (value: number): string =>
    Number.isInteger(value) ? grouped(value) : String(value).replace("-", "\u2212");

export function drawing(
    curves: readonly ShownCurve[],
    lanes: () => readonly Lane[],
    pinned: () => readonly number[],
    moment: () => number | null,
): uPlot.Plugin {
    // Asked for once: a computed style costs more than all the drawing.
    const [muted, ground, grid, edge, pinColour, pastColour, ...motorColours] = [
        "--muted",
        "--page",
        "--grid",
        "--faint",
        "--accent",
        "--warn",
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
        const tall = height / devicePixelRatio;
        const [wish, most] = [Math.max(2, Math.floor(tall / APART)), Math.floor(tall / CLOSEST)];
        for (const value of labels(lane.low, lane.high, wish, most, EDGE / tall)) {
            const y = plot.valToPos(value, lane.scale, true);
            line(ctx, bbox.left, y, bbox.left + bbox.width, y);
            ctx.fillText(shown(value), bbox.left - 6 * devicePixelRatio, y);
        }
        if (index) {
            ctx.strokeStyle = edge!;
            line(ctx, bbox.left - GUTTER * devicePixelRatio, top, bbox.left + bbox.width, top);
        }
    }

    /** The lane's meaning, on a ground of its own. */
    function titleOf(plot: uPlot, lane: Lane, index: number, count: number): void {
        const { ctx, bbox } = plot;
        const [x, y] = [bbox.left + 6 * devicePixelRatio, bbox.top + (bbox.height * index) / count];
        const title = UNITS[lane.scale] ? `${lane.scale} [${UNITS[lane.scale]}]` : lane.scale;
        ctx.textAlign = "left";
        ctx.fillStyle = ground!;
        ctx.fillRect(x - 3, y + 1, ctx.measureText(title).width + 6, 15 * devicePixelRatio);
        ctx.fillStyle = muted!;
        ctx.fillText(title, x, y + 9 * devicePixelRatio);
    }

    /** From now on a curve is drawn in its own lane only; `series` counts from 1. */
    function clip(plot: uPlot, series: number): void {
        const all = lanes();
        const index = all.findIndex(lane => lane.scale === curves[series - 1]?.scale);
        plot.ctx.save();
        if (index < 0) return;
        const height = plot.bbox.height / all.length;
        plot.ctx.beginPath();
        plot.ctx.rect(plot.bbox.left, plot.bbox.top + height * index, plot.bbox.width, height);
        plot.ctx.clip();
    }

    /** Ends `clip`. uPlot sets a style only when it is another than that of the curve before: keep it. */
    function unclip({ ctx }: uPlot): void {
        const { strokeStyle, fillStyle, lineWidth, lineJoin, lineCap } = ctx;
        const dash = ctx.getLineDash();
        ctx.restore();
        Object.assign(ctx, { strokeStyle, fillStyle, lineWidth, lineJoin, lineCap });
        ctx.setLineDash(dash);
    }

    /** A line at a time, where that is in sight. */
    function upright({ ctx, bbox, valToPos }: uPlot, time: number): number | null {
        const x = valToPos(time, "x", true);
        if (x < bbox.left || x > bbox.left + bbox.width) return null;
        line(ctx, x, bbox.top, x, bbox.top + bbox.height);
        return x;
    }

    /** The past moment that is shown, with its name on a ground of its own. */
    function past(plot: uPlot): void {
        const { ctx, bbox } = plot;
        const shownMoment = moment();
        if (shownMoment === null) return;
        ctx.strokeStyle = pastColour!;
        ctx.lineWidth = 2 * devicePixelRatio;
        const x = upright(plot, shownMoment);
        if (x === null) return;
        const text = `${shownMoment.toFixed(3)} s`;
        const wide = ctx.measureText(text).width + 8 * devicePixelRatio;
        const left = Math.min(x, bbox.left + bbox.width - wide);
        ctx.fillStyle = pastColour!;
        ctx.fillRect(left, bbox.top, wide, 15 * devicePixelRatio);
        ctx.fillStyle = ground!;
        ctx.fillText(text, left + 4 * devicePixelRatio, bbox.top + 8 * devicePixelRatio);
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
            const wide = ctx.measureText(mark.text).width;
            const left = x + 4 + wide > bbox.left + bbox.width ? x - 4 - wide : x + 4;
            if (left < free) continue;
            const middle = bbox.top + bbox.height - 7 * devicePixelRatio;
            const { fillStyle } = ctx;
            ctx.globalAlpha = 0.8;
            ctx.fillStyle = ground!;
            ctx.fillRect(left - 1, middle - 6 * devicePixelRatio, wide + 2, 12 * devicePixelRatio);
            ctx.globalAlpha = 0.9;
            ctx.fillStyle = fillStyle;
            ctx.fillText(mark.text, left, middle);
            free = left + wide + 6;
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
                clip(plot, 1);
            },
            drawSeries: (plot, series) => {
                unclip(plot);
                clip(plot, series + 1);
            },
            draw: plot => {
                const { ctx, scales } = plot;
                unclip(plot);
                if (scales.x!.min == null) return;
                ctx.save();
                ctx.font = FONT.replace("11", String(10 * devicePixelRatio));
                ctx.textBaseline = "middle";
                ctx.lineWidth = devicePixelRatio;
                const all = lanes();
                for (const [index, lane] of all.entries()) titleOf(plot, lane, index, all.length);
                marks(plot);
                ctx.strokeStyle = pinColour!;
                for (const pin of pinned()) upright(plot, pin);
                past(plot);
                ctx.restore();
            },
        },
    };
}
