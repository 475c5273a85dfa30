// Curves over the module's time in lanes by unit: pause, zoom, cursors, trigger, marks; export as CSV, PNG and VCD.
import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { shownTheme } from "../logic/theme";
import { COUNTER_COLUMN, clockSeconds, OUTPUT_COLUMN, samples, setWatches, watches, welcome } from "../logic/app";
import { past } from "../logic/past";
import { toCsv, toVcd, type Curve } from "../logic/export";
import { Choice, Empty, IconButton, Menu, offer } from "../widgets/basics";
import { useFrameEffect } from "../widgets/frame";
import { Icon } from "../widgets/icons";
import { makeChart, type Chart, type Reading, type View } from "./plot/chart";
import {
    FIRST,
    SPANS,
    frozen,
    offered,
    shownCurves,
    shownKinds,
    shownMotors,
    span,
    toggle,
    valuesOf,
    watchTitle,
    type ShownCurve,
} from "./plot/curves";
import { Legend, Readout } from "./plot/legend";
import { MoreCurves } from "./plot/more";
import { Scrubber } from "./plot/scrubber";
import { picture } from "./plot/picture";
import { TriggerMenu, fired } from "./plot/trigger";
import { unless } from "../logic/hindrance";

/** All shown curves and what belongs to no motor, for a file. */
const all = (curves: readonly ShownCurve[]): Curve[] => [
    ...curves.map(curve => (curve.derived ? { ...curve, values: valuesOf(curve, 0, samples.length) } : curve)),
    { title: "program counter", column: COUNTER_COLUMN },
    { title: "outputs", column: OUTPUT_COLUMN },
];

function Kinds() {
    return (
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
    );
}

function Motors() {
    return (
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
    );
}

/** The past moment that is shown, in seconds. */
const moment = (): number | null => (past.peek() ? clockSeconds.peek() : null);

export function Plot() {
    const host = useRef<HTMLDivElement>(null);
    const chart = useRef<Chart | null>(null);
    const view = useRef<View>({ time: null, lanes: new Map() });
    const curves = useSignal<ShownCurve[]>([]);
    const zoomed = useSignal(false);
    const cursor = useSignal<Reading | null>(null);
    const right = useSignal(false);
    /** Where the cursor was pinned: none, one or two places. */
    const pins = useSignal<Reading[]>([]);

    useSignalEffect(() => {
        void [shownKinds.value, shownMotors.value, watches.value, welcome.value];
        void shownTheme();
        requestAnimationFrame(() => (curves.value = welcome.value ? shownCurves() : []));
    });
    const redraw = () => chart.current?.redraw();
    const unzoom = () => {
        view.current.time = null;
        view.current.lanes.clear();
        zoomed.value = false;
        pins.value = [];
        redraw();
    };
    useEffect(() => {
        pins.value = [];
        if (!host.current || !curves.value.length) return;
        const made = makeChart(host.current, curves.value, {
            view: view.current,
            onZoom: () => (zoomed.value = true),
            onUnzoom: unzoom,
            onCursor: (reading, isRight) => {
                cursor.value = reading;
                if (reading) right.value = isRight;
            },
            onClick: () => {
                const reading = cursor.peek();
                pins.value = pins.peek().length > 1 || !reading ? [] : [...pins.peek(), reading];
            },
            moment,
            pinned: () => pins.peek().map(({ time }) => time),
        });
        chart.current = made;
        return () => {
            made.destroy();
            chart.current = null;
        };
    }, [curves.value]);
    useFrameEffect(() => {
        void [span.value, past.value && clockSeconds.value];
        redraw();
    });
    useSignalEffect(() => {
        const at = fired.value;
        if (at === null) return;
        view.current.time = { min: at - span.peek() / 2, max: at + span.peek() / 2 };
        zoomed.value = true;
        redraw();
    });

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
                <Kinds />
                <Motors />
                <span class="gap" />
                <Choice label="Span" value={span.value} options={SPANS} onChange={value => (span.value = value)} />
                <span class="keys">
                    <TriggerMenu curves={curves.value} />
                    <IconButton
                        icon="pause"
                        title="Hold the picture"
                        label="Hold the plot"
                        pressed={frozen.value}
                        onClick={() => (frozen.value = !frozen.value)}
                    />
                    <button
                        class={`tool ${zoomed.value ? "on" : ""}`}
                        {...unless(!zoomed.value && "The newest is shown", "Show the newest again (double click)")}
                        aria-label="Show the newest"
                        onClick={unzoom}
                    >
                        <Icon name="expand" />
                    </button>
                    <Menu icon="save" label="Export">
                        <button role="menuitem" onClick={() => offer("plot.csv", toCsv(samples, all(curves.value)))}>
                            CSV table
                        </button>
                        <button role="menuitem" onClick={savePng}>
                            PNG picture
                        </button>
                        <button role="menuitem" onClick={() => offer("plot.vcd", toVcd(samples, all(curves.value)))}>
                            VCD for GTKWave, Surfer
                        </button>
                        <button
                            role="menuitem"
                            onClick={() => {
                                samples.clear();
                                redraw();
                            }}
                        >
                            Clear all samples
                        </button>
                    </Menu>
                </span>
            </div>
            {curves.value.length ? (
                <>
                    <Legend curves={curves.value} />
                    <div class="canvas" ref={host}>
                        <Readout
                            curves={curves.value}
                            readings={[...pins.value, ...(cursor.value ? [cursor.value] : [])].slice(0, 2)}
                            left={right.value}
                        />
                    </div>
                </>
            ) : (
                <Empty icon="wave" title="No curve chosen">
                    Choose what to plot above.
                </Empty>
            )}
            <Scrubber />
        </div>
    );
}
