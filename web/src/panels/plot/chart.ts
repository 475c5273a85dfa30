// The canvas of a plot: lanes, zooming by wheel and drag, the cursor.
import uPlot from "uplot";
import { axisParameter, frameListeners, samples } from "../../logic/app";
import { laneRange, spanWith, zoomed, type Lane } from "../../logic/lanes";
import { FULL_CURRENT } from "../../logic/units";
import { css, dataBetween, frozen, span, type ShownCurve } from "./curves";
import { GUTTER, TITLE_PX, drawing } from "./drawing";

/** What the curves were at a time. */
export interface Reading {
    time: number;
    values: (number | null)[];
}

/** What a person has chosen to see, kept when the curves change. */
export interface View {
    time: { min: number; max: number } | null;
    lanes: Map<string, [number, number]>;
}

export interface Chart {
    redraw: () => void;
    destroy: () => void;
}

interface Wishes {
    view: View;
    /** The range of the view was chosen. */
    onZoom: () => void;
    onUnzoom: () => void;
    /** The cursor is at a time, or nowhere; `right` is in the right half. */
    onCursor: (reading: Reading | null, right: boolean) => void;
    onClick: () => void;
    /** The past moment that is shown, which stays in sight; null while it is the present. */
    moment: () => number | null;
    pinned: () => readonly number[];
}

/** Room above and below the curves; loads and currents show all their range. */
function pad(scale: string, low: number | null, high: number | null): [number, number] {
    if (low == null || high == null || Number.isNaN(low)) return [0, 1];
    if (scale === "load") return [-0.5, axisParameter("load_value").high + 0.5];
    if (scale === "current") return [-10, FULL_CURRENT + 10];
    const room = Math.max((high - low) * 0.08, scale === "position" ? 10 : 2);
    return [low - room, high + room];
}

/** A range with so much of its lane free at the top. */
const roomFor = (part: number, [low, high]: [number, number]): [number, number] => [
    low,
    low + (high - low) / (1 - Math.min(part, 0.5)),
];

/** The newest value up to a point: points where a curve was not looked at are passed over, gaps are not. */
function lastLooked(values: ArrayLike<number | null | undefined>, at: number): number | null {
    while (at > 0 && values[at] === undefined) at--;
    return values[at] ?? null;
}

/** A curve that is set at once and not passed through. */
const stairs = uPlot.paths.stepped!({ align: 1 });
const NOTHING = { left: 0, width: 0, top: 0, height: 0 };
/** Milliseconds between two pictures, at least. */
const PAUSE_MS = 40;
/** The same of spans longer than `LONG_S` seconds, which move slowly and have many samples. */
const LONG_PAUSE_MS = 200;
const LONG_S = 60;
/** Pixels that a press may move and still be a click. */
const STILL = 4;

export function makeChart(element: HTMLElement, curves: readonly ShownCurve[], wishes: Wishes): Chart {
    const { view } = wishes;
    const used = [...new Set(curves.map(({ scale }) => scale))];
    const lanes = new Map<string, Lane>();
    const scales: uPlot.Scales = { x: { time: false } };
    used.forEach((scale, at) => {
        scales[scale] = {
            auto: true,
            range: (_, least, most) => {
                const tall = size.height / used.length;
                const [low, high] = view.lanes.get(scale) ?? roomFor(TITLE_PX / tall, pad(scale, least, most));
                lanes.set(scale, { scale, low, high });
                return laneRange(low, high, at, used.length);
            },
        };
    });
    const laneAt = (y: number, full: number) =>
        used[Math.max(0, Math.min(used.length - 1, Math.floor((y / full) * used.length)))]!;
    const measure = () => ({ width: element.clientWidth, height: Math.max(60, element.clientHeight) });
    // Kept: to ask for it at each picture would lay the page out once more.
    let size = measure();
    let drawn = -1;
    let last = 0;

    const select = (self: uPlot) => {
        const { left, top, width, height: tall } = self.select;
        if (width < STILL && tall < STILL) return;
        const [wide, full] = [self.bbox.width / devicePixelRatio, self.bbox.height / devicePixelRatio];
        if (width >= STILL && width < wide - 1)
            view.time = { min: self.posToVal(left, "x"), max: self.posToVal(left + width, "x") };
        const lane = laneAt(top + tall / 2, full);
        if (tall >= STILL && tall < full - 1)
            view.lanes.set(lane, [self.posToVal(top + tall, lane), self.posToVal(top, lane)]);
        wishes.onZoom();
        self.setSelect(NOTHING, false);
        drawn = -1;
    };
    const look = (self: uPlot) => {
        const at = self.cursor.idx;
        const right = self.cursor.left! > self.bbox.width / devicePixelRatio / 2;
        if (at == null) return wishes.onCursor(null, right);
        const values = curves.map((_, n) => lastLooked(self.data[n + 1] ?? [], at));
        wishes.onCursor({ time: self.data[0]![at]!, values }, right);
    };
    const plot = new uPlot(
        {
            ...size,
            legend: { show: false },
            padding: [4, 24, 0, GUTTER],
            scales,
            plugins: [
                drawing(curves, () => used.flatMap(scale => lanes.get(scale) ?? []), wishes.pinned, wishes.moment),
            ],
            cursor: {
                drag: { x: true, y: true, uni: 24, setScale: false },
                points: { size: 5 },
                bind: {
                    dblclick: self =>
                        (() => {
                            wishes.onUnzoom();
                            self.setSelect(NOTHING, false);
                            return null;
                        }) as never,
                },
            },
            axes: [
                {
                    stroke: css("--muted"),
                    grid: { stroke: css("--grid"), width: 1 },
                    ticks: { show: false },
                    font: "11px system-ui",
                    size: 24,
                    gap: 4,
                    values: (_, ticks) => ticks.map(tick => `${+tick.toFixed(3)} s`),
                },
            ],
            series: [
                {},
                ...curves.map(
                    ({ title, scale, colour, dash, width, set }): uPlot.Series => ({
                        label: title,
                        scale,
                        stroke: colour,
                        width,
                        dash,
                        paths: set ? stairs : undefined,
                        points: { show: false },
                        spanGaps: false,
                    }),
                ),
            ],
            hooks: { setCursor: [look], setSelect: [select] },
        },
        dataBetween(curves, 0, 0, 1),
        element,
    );

    const draw = () => {
        const now = performance.now();
        const pause = span.peek() > LONG_S ? LONG_PAUSE_MS : PAUSE_MS;
        if (samples.version === drawn || now - last < pause) return;
        if (frozen.peek() && drawn >= 0 && !view.time) return;
        last = now;
        drawn = samples.version;
        const end = samples.length ? samples.time(samples.length - 1) : 0;
        const start = samples.length ? Math.max(samples.time(0), end - span.peek()) : 0;
        const chosen = view.time ?? { min: start, max: Math.max(end, start + span.peek()) };
        const moment = wishes.moment();
        const range = moment === null ? chosen : spanWith(chosen, moment);
        element.dataset.span = `${range.min} ${range.max}`;
        element.dataset.moment = String(moment ?? "");
        plot.batch(() => {
            plot.setData(dataBetween(curves, range.min, range.max, size.width), true);
            plot.setScale("x", range);
        });
    };
    const redraw = () => {
        drawn = -1;
        last = 0;
        draw();
    };
    const wheel = (event: WheelEvent) => {
        event.preventDefault();
        const name = laneAt(event.offsetY, plot.over.clientHeight);
        const lane = lanes.get(name);
        if (!lane) return;
        const centre = plot.posToVal(event.offsetY, name);
        view.lanes.set(name, zoomed([lane.low, lane.high], centre, 1.2 ** Math.sign(event.deltaY)));
        wishes.onZoom();
        redraw();
    };
    listen(plot, wheel, () => {
        wishes.onClick();
        plot.redraw(false);
    });
    frameListeners.add(draw);
    redraw();
    element.dataset.curves = String(curves.length);
    const observer = new ResizeObserver(() => plot.setSize((size = measure())));
    observer.observe(element);
    return {
        redraw,
        destroy: () => {
            frameListeners.delete(draw);
            observer.disconnect();
            plot.destroy();
        },
    };
}

function listen({ over }: uPlot, wheel: (event: WheelEvent) => void, click: () => void): void {
    over.addEventListener("wheel", wheel, { passive: false });
    let pressed = 0;
    over.addEventListener("pointerdown", event => (pressed = event.clientX));
    over.addEventListener("click", event => {
        if (Math.abs(event.clientX - pressed) <= STILL) click();
    });
    // A finger drags as a mouse does; across, that is: up and down scrolls the page.  uPlot wants to see it move.
    const asMouse =
        (target: EventTarget, name: string) =>
        ({ pointerType, clientX, clientY }: PointerEvent) => {
            if (pointerType !== "mouse") target.dispatchEvent(new MouseEvent(name, { clientX, clientY, movementX: 1 }));
        };
    over.addEventListener("pointerdown", asMouse(over, "mousedown"));
    over.addEventListener("pointermove", asMouse(over, "mousemove"));
    for (const end of ["pointerup", "pointercancel"] as const) over.addEventListener(end, asMouse(document, "mouseup"));
}
