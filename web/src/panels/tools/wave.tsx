// The microstep wave of the motion chip: drawn, changed by formula, by drag or by number, and sent after a summary.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { online } from "../../logic/app";
import { CELLS, cells, coil, keepTable, readTable, sine, writeTable } from "../../logic/chip_tables";
import { LocalNumber } from "../../widgets/fields";
import { Empty } from "../../widgets/basics";

const PLACES = 256;
const HIGHEST = 63;
const WIDTH = 640;
const HEIGHT = 220;
const MIDDLE = HEIGHT / 2;
const SCALE = (MIDDLE - 12) / HIGHEST;
const LARGEST_OFFSET = 32;

const line = (table: readonly number[], shift: number): string =>
    Array.from({ length: PLACES + 1 }, (_, place) => {
        const x = (place / PLACES) * WIDTH;
        return `${place ? "L" : "M"}${x.toFixed(1)} ${(MIDDLE - coil(table, (place + shift) & 255) * SCALE).toFixed(1)}`;
    }).join("");

/** In place of a table that the module has not sent. */
export const NotRead = (props: { icon: string; name: Parameters<typeof readTable>[0]; what: string }) => (
    <Empty icon={props.icon} title="Not read yet">
        <button class="link" disabled={!online.value} onClick={() => readTable(props.name)}>
            Read the {props.what} of the module
        </button>
    </Empty>
);

export function Wave() {
    const known = cells.value.microstep_table;
    const draft = useSignal<number[] | null>(null);
    const offset = useSignal(0);
    useEffect(() => void readTable("microstep_table"), []);
    if (!known) return <NotRead icon="wave" name="microstep_table" what="wave" />;
    const shown = draft.value ?? known;
    const changed = shown.filter((value, at) => value !== known[at]).length;
    const set = (at: number, value: number) => (draft.value = shown.map((old, n) => (n === at ? value : old)));
    return (
        <div class="tool-body chip-table">
            <Drawing table={shown} before={changed ? known : null} onSet={set} />
            <div class="row">
                <label>
                    Sine from
                    <LocalNumber
                        value={offset.value}
                        low={0}
                        high={LARGEST_OFFSET}
                        width={56}
                        label="Offset of the sine"
                        onInput={value => value !== null && (offset.value = value)}
                    />
                </label>
                <button onClick={() => (draft.value = sine(offset.value))}>Take this sine</button>
                <span class="muted note">An offset of 1 suits most motors in mixed decay.</span>
            </div>
            <Apply
                name="microstep_table"
                title="Another microstep wave"
                draft={draft.value}
                changed={changed}
                drop={() => (draft.value = null)}
            />
            <h3>Quarter wave, 64 values of 0 to 63</h3>
            <div class="cells">
                {shown.map((value, at) => (
                    <label key={at} class={value !== known[at] ? "unsent" : ""}>
                        <span>{at}</span>
                        <LocalNumber
                            value={value}
                            low={0}
                            high={HIGHEST}
                            label={`Wave value ${at}`}
                            onInput={next => next !== null && set(at, next)}
                        />
                    </label>
                ))}
            </div>
        </div>
    );
}

/** The currents of both coils over four full steps; the first quarter can be drawn. */
function Drawing({
    table,
    before,
    onSet,
}: {
    table: number[];
    before: number[] | null;
    onSet: (at: number, value: number) => void;
}) {
    const box = useRef<SVGSVGElement>(null);
    const drag = (event: PointerEvent) => {
        const frame = box.current!.getBoundingClientRect();
        const at = Math.floor(((event.clientX - frame.left) / frame.width) * PLACES);
        if (at < 0 || at >= CELLS) return;
        const y = ((event.clientY - frame.top) / frame.height) * HEIGHT;
        onSet(at, Math.max(0, Math.min(HIGHEST, Math.round((MIDDLE - y) / SCALE))));
    };
    return (
        <svg
            ref={box}
            class="wave-drawing"
            viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
            role="img"
            aria-label={`Currents of coil A (sine) and B (cosine) over four full steps, from 0 to ${Math.max(...table)}`}
            onPointerDown={event => {
                event.currentTarget.setPointerCapture(event.pointerId);
                drag(event);
            }}
            onPointerMove={event => event.buttons === 1 && drag(event)}
        >
            <rect class="quarter" x="0" y="0" width={WIDTH / 4} height={MIDDLE} />
            {[0, 1, 2, 3, 4].map(step => (
                <line key={step} class="grid" x1={(step * WIDTH) / 4} x2={(step * WIDTH) / 4} y1="0" y2={HEIGHT} />
            ))}
            <line class="grid" x1="0" x2={WIDTH} y1={MIDDLE} y2={MIDDLE} />
            {before && <path class="before" d={line(before, 0)} />}
            <path class="coil-b" d={line(table, CELLS)} />
            <path class="coil-a" d={line(table, 0)} />
            <text x="6" y={HEIGHT - 8}>
                draw in the shaded quarter
            </text>
            <text class="coil-a" x={WIDTH - 150} y="14">
                coil A
            </text>
            <text class="coil-b" x={WIDTH - 80} y="14">
                coil B
            </text>
        </svg>
    );
}

/** Sending a draft, dropping it, and the table in the EEPROM. */
export function Apply(props: {
    name: "driver_chain" | "microstep_table";
    title: string;
    draft: number[] | null;
    changed: number;
    drop: () => void;
}) {
    const { name, draft, changed } = props;
    const send = async () => {
        await writeTable(name, draft!, props.title);
        if (draft!.every((cell, at) => cell === cells.peek()[name]?.[at])) props.drop();
    };
    return (
        <div class="row">
            <button class="primary" disabled={!changed || !online.value} onClick={send}>
                Apply…
            </button>
            <button disabled={!draft} onClick={props.drop}>
                Drop the draft
            </button>
            <span class={`pill ${changed ? "warn" : ""}`}>
                {changed ? `${changed} ${changed === 1 ? "cell is" : "cells are"} not sent` : "as in the module"}
            </span>
            <span class="gap" />
            <button disabled={!online.value} onClick={() => readTable(name)}>
                Read again
            </button>
            <button
                disabled={!online.value || !!changed}
                title="STGP: the whole table into the EEPROM"
                onClick={() => keepTable(name, "STGP")}
            >
                Store
            </button>
            <button
                disabled={!online.value}
                title="RSGP: the whole table out of the EEPROM"
                onClick={() => keepTable(name, "RSGP")}
            >
                Restore
            </button>
        </div>
    );
}
