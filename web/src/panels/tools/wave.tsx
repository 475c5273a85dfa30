// The microstep wave of the motion chip: drawn, changed by formula, by drag or by number, and sent after a summary.
import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { CELLS, coil, sine } from "../../logic/chip_tables";
import { LocalNumber } from "../../widgets/fields";
import { Apply, NotRead, useDraft } from "./chip-table";

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

export function Wave() {
    const draft = useDraft("microstep_table");
    const offset = useSignal(0);
    if (!draft) return <NotRead icon="wave" name="microstep_table" what="wave" />;
    const { known, shown, changed, set } = draft;
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
                <button onClick={() => draft.take(sine(offset.value))}>Take this sine</button>
                <span class="muted note">An offset of 1 suits most motors in mixed decay.</span>
            </div>
            <Apply draft={draft} title="Another microstep wave" />
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
