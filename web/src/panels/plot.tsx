// Curves over the module's time in lanes by unit: pause, zoom, cursors, trigger, marks; export as CSV, PNG and VCD.
import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import {
    COUNTER_COLUMN,
    OUTPUT_COLUMN,
    WATCH_SLOTS,
    frameListeners,
    samples,
    setWatches,
    tables,
    watches,
    welcome,
} from "../logic/app";
import { shownTheme } from "../logic/actions";
import { toCsv, toVcd, type Curve } from "../logic/export";
import { laneRange, zoomed as zoomedRange, type Lane } from "../logic/lanes";
import { grouped } from "../logic/units";
import type { Parameter } from "../wire";
import { Choice, Empty, Menu, offer } from "../widgets/basics";
import { Icon } from "../widgets/icons";
import {
    FIRST,
    SPANS,
    css,
    dataBetween,
    frozen,
    offered,
    shownCurves,
    shownKinds,
    shownMotors,
    span,
    watchTitle,
    type ShownCurve,
} from "./plot/curves";
import { GUTTER, drawing } from "./plot/drawing";
import { TriggerMenu, fired } from "./plot/trigger";

interface Reading {
    time: number;
    values: (number | null)[];
    /** The cursor is in the right half: the readout goes to the left. */
    right: boolean;
}

export function Plot() {
    const host = useRef<HTMLDivElement>(null);
    const readout = useSignal<Reading | null>(null);
    /** What the cursor read where it was pinned; the readout shows the difference. */
    const pin = useSignal<Reading | null>(null);
    const zoom = useRef<{ min: number; max: number } | null>(null);
    /** Ranges of lanes that a person has chosen. */
    const laneZoom = useRef(new Map<string, [number, number]>());
    const chart = useRef<uPlot | null>(null);
    const curves = useSignal<ShownCurve[]>([]);
    const zoomed = useSignal(false);

    useSignalEffect(() => {
        void [shownKinds.value, shownMotors.value, watches.value, welcome.value];
        void shownTheme();
        requestAnimationFrame(() => (curves.value = welcome.value ? shownCurves() : []));
    });

    useEffect(() => {
        const element = host.current;
        pin.value = null;
        if (!element || !curves.value.length) return;
        const list = curves.value;
        const grid = { stroke: css("--grid"), width: 1 };
        const scales: uPlot.Scales = { x: { time: false } };
        const used = [...new Set(list.map(({ scale }) => scale))];
        const lanes = new Map<string, Lane>();
        used.forEach((scale, at) => {
            scales[scale] = {
                auto: true,
                range: (_, least, most) => {
                    const [low, high] = laneZoom.current.get(scale) ?? pad(scale, least, most);
                    lanes.set(scale, { scale, low, high });
                    return laneRange(low, high, at, used.length);
                },
            };
        });
        const laneAt = (y: number, full: number) =>
            used[Math.max(0, Math.min(used.length - 1, Math.floor((y / full) * used.length)))]!;
        const plot = new uPlot(
            {
                width: element.clientWidth,
                height: Math.max(60, element.clientHeight),
                legend: { show: false },
                padding: [4, 8, 0, GUTTER],
                scales,
                plugins: [
                    drawing(
                        list,
                        () => used.flatMap(scale => lanes.get(scale) ?? []),
                        () => pin.peek()?.time ?? null,
                    ),
                ],
                cursor: {
                    drag: { x: true, y: true, uni: 24, setScale: false },
                    points: { size: 5 },
                    bind: {
                        dblclick: self =>
                            (() => {
                                unzoom();
                                self.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
                                return null;
                            }) as never,
                    },
                },
                axes: [
                    {
                        stroke: css("--muted"),
                        grid,
                        ticks: { show: false },
                        font: "11px system-ui",
                        size: 24,
                        gap: 4,
                        values: (_, ticks) => ticks.map(tick => `${+tick.toFixed(3)} s`),
                    },
                ],
                series: [
                    {},
                    ...list.map(
                        ({ title, scale, colour, dash, width }): uPlot.Series => ({
                            label: title,
                            scale,
                            stroke: colour,
                            width,
                            dash,
                            points: { show: false },
                            spanGaps: false,
                        }),
                    ),
                ],
                hooks: {
                    setCursor: [
                        self => {
                            const at = self.cursor.idx;
                            readout.value =
                                at == null
                                    ? null
                                    : {
                                          time: self.data[0]![at]!,
                                          values: list.map((_, n) => self.data[n + 1]?.[at] ?? null),
                                          right: self.cursor.left! > self.bbox.width / devicePixelRatio / 2,
                                      };
                        },
                    ],
                    setSelect: [
                        self => {
                            const { left, top, width, height } = self.select;
                            if (width < 4 && height < 4) return;
                            const full = self.bbox.height / devicePixelRatio;
                            if (width >= 4 && width < self.bbox.width / devicePixelRatio - 1)
                                zoom.current = { min: self.posToVal(left, "x"), max: self.posToVal(left + width, "x") };
                            const lane = laneAt(top + height / 2, full);
                            if (height >= 4 && height < full - 1)
                                laneZoom.current.set(lane, [
                                    self.posToVal(top + height, lane),
                                    self.posToVal(top, lane),
                                ]);
                            zoomed.value = true;
                            self.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
                            drawn = -1;
                        },
                    ],
                },
            },
            dataBetween(list, 0, 0),
            element,
        );
        const over = plot.over;
        over.addEventListener(
            "wheel",
            event => {
                event.preventDefault();
                const name = laneAt(event.offsetY, over.clientHeight);
                const lane = lanes.get(name);
                if (!lane) return;
                laneZoom.current.set(
                    name,
                    zoomedRange(
                        [lane.low, lane.high],
                        plot.posToVal(event.offsetY, name),
                        1.2 ** Math.sign(event.deltaY),
                    ),
                );
                zoomed.value = true;
                redraw.current();
            },
            { passive: false },
        );
        let pressed = 0;
        over.addEventListener("pointerdown", event => (pressed = event.clientX));
        over.addEventListener("click", event => {
            if (Math.abs(event.clientX - pressed) > 4) return;
            pin.value = pin.peek() ? null : readout.peek();
            plot.redraw(false);
        });
        // A finger drags as a mouse does; across, that is: up and down scrolls the page.  uPlot wants to see it move.
        const asMouse =
            (target: EventTarget, name: string) =>
            ({ pointerType, clientX, clientY }: PointerEvent) => {
                if (pointerType !== "mouse")
                    target.dispatchEvent(new MouseEvent(name, { clientX, clientY, movementX: 1 }));
            };
        over.addEventListener("pointerdown", asMouse(over, "mousedown"));
        over.addEventListener("pointermove", asMouse(over, "mousemove"));
        for (const end of ["pointerup", "pointercancel"] as const)
            over.addEventListener(end, asMouse(document, "mouseup"));
        chart.current = plot;
        let drawn = -1;
        let last = 0;
        const draw = () => {
            const now = performance.now();
            if (samples.version === drawn || now - last < 40) return;
            if (frozen.peek() && drawn >= 0 && !zoom.current) return;
            last = now;
            drawn = samples.version;
            const end = samples.length ? samples.time(samples.length - 1) : 0;
            const start = samples.length ? Math.max(samples.time(0), end - span.peek()) : 0;
            const range = zoom.current ?? { min: start, max: Math.max(end, start + span.peek()) };
            plot.batch(() => {
                plot.setData(dataBetween(list, range.min, range.max), true);
                plot.setScale("x", range);
            });
        };
        redraw.current = () => {
            drawn = -1;
            last = 0;
            draw();
        };
        frameListeners.add(draw);
        redraw.current();
        const observer = new ResizeObserver(() => {
            plot.setSize({ width: element.clientWidth, height: Math.max(60, element.clientHeight) });
        });
        observer.observe(element);
        return () => {
            frameListeners.delete(draw);
            observer.disconnect();
            plot.destroy();
            chart.current = null;
        };
    }, [curves.value]);
    const redraw = useRef<() => void>(() => {});
    useSignalEffect(() => {
        void span.value;
        redraw.current();
    });
    useSignalEffect(() => {
        const at = fired.value;
        if (at === null) return;
        zoom.current = { min: at - span.peek() / 2, max: at + span.peek() / 2 };
        zoomed.value = true;
        redraw.current();
    });

    const unzoom = () => {
        zoom.current = null;
        laneZoom.current.clear();
        zoomed.value = false;
        redraw.current();
    };
    const all = (): Curve[] => [
        ...curves.value.filter(({ column }) => column >= 0),
        { title: "program counter", column: COUNTER_COLUMN },
        { title: "outputs", column: OUTPUT_COLUMN },
    ];
    const savePng = () => {
        const canvas = host.current?.querySelector("canvas");
        if (canvas) picture(canvas, curves.value).toBlob(blob => blob && offer("plot.png", blob));
    };
    if (!welcome.value)
        return (
            <Empty icon="wave" title="Nothing to plot yet">
                Curves appear when the module is connected.
            </Empty>
        );
    return (
        <div class="plot">
            <div class="bar">
                <div class="chips" role="group" aria-label="Curves">
                    {offered()
                        .filter(({ curve }) => FIRST.has(curve) || shownKinds.value.includes(curve))
                        .map(({ curve, title }) => (
                            <button
                                key={curve}
                                class={`chip ${shownKinds.value.includes(curve) ? "on" : ""}`}
                                aria-pressed={shownKinds.value.includes(curve)}
                                onClick={() => (shownKinds.value = toggle(shownKinds.value, curve))}
                            >
                                {title}
                            </button>
                        ))}
                    {watches.value.map((watch, at) => (
                        <button
                            key={`w${at}`}
                            class="chip on watch"
                            title="Remove this curve"
                            onClick={() => setWatches(watches.value.filter((_, n) => n !== at))}
                        >
                            {watchTitle(watch)} <Icon name="close" size={10} />
                        </button>
                    ))}
                    <MoreCurves />
                </div>
                <div class="chips" role="group" aria-label="Motors">
                    {[0, 1, 2].map(motor => (
                        <button
                            key={motor}
                            class={`chip motor${motor} ${shownMotors.value.includes(motor) ? "on" : ""}`}
                            aria-pressed={shownMotors.value.includes(motor)}
                            title={`Motor ${motor}`}
                            onClick={() => (shownMotors.value = toggle(shownMotors.value, motor).sort())}
                        >
                            {motor}
                        </button>
                    ))}
                </div>
                <span class="gap" />
                <Choice label="Span" value={span.value} options={SPANS} onChange={value => (span.value = value)} />
                <TriggerMenu curves={curves.value} />
                <button
                    class={`tool ${frozen.value ? "on" : ""}`}
                    title="Hold the picture"
                    aria-label="Hold the plot"
                    aria-pressed={frozen.value}
                    onClick={() => (frozen.value = !frozen.value)}
                >
                    <Icon name="pause" />
                </button>
                {zoomed.value && (
                    <button
                        class="tool on"
                        title="Show the newest again (double click)"
                        aria-label="Show the newest"
                        onClick={unzoom}
                    >
                        <Icon name="expand" />
                    </button>
                )}
                <Menu icon="save" label="Export">
                    <button role="menuitem" onClick={() => offer("plot.csv", toCsv(samples, all()))}>
                        CSV table
                    </button>
                    <button role="menuitem" onClick={savePng}>
                        PNG picture
                    </button>
                    <button role="menuitem" onClick={() => offer("plot.vcd", toVcd(samples, all()))}>
                        VCD for GTKWave, Surfer
                    </button>
                    <button
                        role="menuitem"
                        onClick={() => {
                            samples.clear();
                            redraw.current();
                        }}
                    >
                        Forget all samples
                    </button>
                </Menu>
            </div>
            {curves.value.length ? (
                <div class="canvas" ref={host}>
                    {readout.value && (
                        <table class={`readout ${readout.value.right ? "left" : ""}`}>
                            <tbody>
                                <tr>
                                    <th>time</th>
                                    <td>{readout.value.time.toFixed(3)} s</td>
                                    {pin.value && <td>Δ {(readout.value.time - pin.value.time).toFixed(3)} s</td>}
                                </tr>
                                {curves.value.map((curve, n) => (
                                    <tr key={curve.title}>
                                        <th style={{ color: curve.colour }}>{curve.title}</th>
                                        <td>{figure(readout.value!.values[n])}</td>
                                        {pin.value && (
                                            <td>{figure(readout.value!.values[n]! - pin.value.values[n]!)}</td>
                                        )}
                                    </tr>
                                ))}
                            </tbody>
                        </table>
                    )}
                </div>
            ) : (
                <Empty icon="wave" title="No curve chosen">
                    Choose what to plot above.
                </Empty>
            )}
        </div>
    );
}

/** Room above and below the curves; speeds and loads show their zero. */
function pad(scale: string, low: number | null, high: number | null): [number, number] {
    if (low == null || high == null || Number.isNaN(low)) return [0, 1];
    if (scale === "load") return [-0.5, 7.5];
    if (scale === "current") return [-10, 265];
    const room = Math.max((high - low) * 0.08, scale === "position" ? 10 : 2);
    return [low - room, high + room];
}

const figure = (value: number | null | undefined): string =>
    value == null || Number.isNaN(value) ? "" : grouped(value);

/** The plot on the page's ground, with a legend above it. */
function picture(plot: HTMLCanvasElement, curves: readonly ShownCurve[]): HTMLCanvasElement {
    const canvas = document.createElement("canvas");
    const scale = devicePixelRatio;
    const head = 26 * scale;
    canvas.width = plot.width;
    canvas.height = plot.height + head;
    const ctx = canvas.getContext("2d")!;
    ctx.fillStyle = css("--page");
    ctx.fillRect(0, 0, canvas.width, canvas.height);
    ctx.font = `${11 * scale}px system-ui`;
    let x = 12 * scale;
    for (const { title, colour } of curves) {
        ctx.fillStyle = colour;
        ctx.fillText(title, x, 17 * scale);
        x += ctx.measureText(title).width + 16 * scale;
    }
    ctx.drawImage(plot, 0, head);
    return canvas;
}

/** Curves that are not always offered, and any parameter. */
function MoreCurves() {
    const wish = useSignal("");
    const add = (bank: number, number: number, motor: number) =>
        setWatches([...watches.value, { bank, number, motor }]);
    const full = watches.value.length >= WATCH_SLOTS;
    const fits = (row: Parameter) =>
        row.access.includes("R") && `${row.number} ${row.name}`.toLowerCase().includes(wish.value.toLowerCase());
    return (
        <Menu icon="plus" text="more" class="chip add" label="More curves" tall>
            {offered()
                .filter(({ curve }) => !FIRST.has(curve))
                .map(({ curve, title }) => (
                    <div class="menu-row" key={curve}>
                        <span>{title}</span>
                        <button role="menuitem" onClick={() => (shownKinds.value = toggle(shownKinds.value, curve))}>
                            {shownKinds.value.includes(curve) ? "hide" : "show"}
                        </button>
                    </div>
                ))}
            <input
                placeholder="any parameter"
                aria-label="Search parameter"
                value={wish.value}
                onInput={event => (wish.value = event.currentTarget.value)}
            />
            {full && <p class="note">Eight parameters are plotted: remove one first.</p>}
            {!full &&
                tables.value.axis.filter(fits).map(row => (
                    <div class="menu-row" key={row.number}>
                        <span>
                            {row.number} {row.name}
                        </span>
                        {[0, 1, 2].map(motor => (
                            <button
                                key={motor}
                                role="menuitem"
                                class={`motor${motor}`}
                                aria-label={`Plot ${row.name} of motor ${motor}`}
                                onClick={() => add(-1, row.number, motor)}
                            >
                                {motor}
                            </button>
                        ))}
                    </div>
                ))}
            {!full &&
                tables.value.globals
                    .filter(row => fits(row) && (row.bank === 2 || row.number > 63 || row.number === 5))
                    .map(row => (
                        <div class="menu-row" key={row.key}>
                            <span>
                                {row.bank === 2 ? "" : `${row.number} `}
                                {row.name}
                            </span>
                            <button role="menuitem" onClick={() => add(row.bank, row.number, 0)}>
                                add
                            </button>
                        </div>
                    ))}
        </Menu>
    );
}

const toggle = <T,>(list: readonly T[], item: T): T[] =>
    list.includes(item) ? list.filter(other => other !== item) : [...list, item];
