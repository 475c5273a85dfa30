// A plot as a picture of its own.
import { css, type ShownCurve } from "./curves";

const ROW = 18;
const MARGIN = 12;
const LINE = 22;

/** The plot on the page's ground, with a legend above it. */
export function picture(plot: HTMLCanvasElement, curves: readonly ShownCurve[]): HTMLCanvasElement {
    const canvas = document.createElement("canvas");
    const ctx = canvas.getContext("2d")!;
    const scale = devicePixelRatio;
    const font = `${11 * scale}px system-ui`;
    ctx.font = font;
    const places = placesOf(curves, plot.width / scale, title => ctx.measureText(title).width / scale);
    const head = ROW * ((places.at(-1)?.row ?? 0) + 1) + 8;
    canvas.width = plot.width;
    canvas.height = plot.height + head * scale;
    ctx.fillStyle = css("--page");
    ctx.fillRect(0, 0, canvas.width, canvas.height);
    ctx.drawImage(plot, 0, head * scale);
    ctx.scale(scale, scale);
    ctx.font = "11px system-ui";
    ctx.textBaseline = "middle";
    curves.forEach((curve, at) => {
        const { x, row } = places[at]!;
        const y = row * ROW + ROW / 2 + 4;
        ctx.strokeStyle = curve.colour;
        ctx.lineWidth = 2;
        ctx.setLineDash(curve.dash ?? []);
        ctx.beginPath();
        ctx.moveTo(x, y);
        ctx.lineTo(x + LINE, y);
        ctx.stroke();
        ctx.fillStyle = css("--text");
        ctx.fillText(curve.title, x + LINE + 6, y);
    });
    return canvas;
}

/** Where the legend's entries stand: in rows as wide as the picture. */
function placesOf(curves: readonly ShownCurve[], width: number, widthOf: (title: string) => number) {
    let [x, row] = [MARGIN, 0];
    return curves.map(({ title }) => {
        const size = LINE + 6 + widthOf(title) + 16;
        if (x + size > width && x > MARGIN) [x, row] = [MARGIN, row + 1];
        const place = { x, row };
        x += size;
        return place;
    });
}
