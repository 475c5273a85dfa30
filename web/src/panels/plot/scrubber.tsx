// The whole history under the plot: marks of what happened, and the moment that is shown; dragging shows another one.
import { computed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { can } from "../../logic/app";
import { branch, end, hertz, history, leave, marks, past, readMarks, show } from "../../logic/past";
import { time } from "../../logic/app";
import type { Mark } from "../../wire";
import { Sketch, type Pen } from "../../widgets/sketch";
import { unless } from "../../logic/hindrance";

/** Between two looks for new marks. */
const EACH_MS = 1500;
/** Pixels around the pointer in which a mark is named. */
const NEAR = 6;
const COLOURS: Record<string, string> = {
    program: "--accent",
    held: "--warn",
    fault: "--bad",
    power: "--bad",
    log: "--muted",
    target: "--good",
};

const colourOf = ({ kind, motor }: Mark): string => COLOURS[kind] ?? (motor >= 0 ? `--motor${motor}` : "--text");

/** Clocks of the ends of the branch that is shown. */
const range = computed(() => {
    const oldest = branch.value?.oldest ?? 0;
    return { oldest, last: Math.max(end.value, oldest + 1) };
});

function draw({ ctx, width, height, colour }: Pen): void {
    const found = marks.value;
    const { oldest, last } = range.value;
    if (!found) return;
    const at = (clock: number): number => ((clock - oldest) / (last - oldest)) * width;
    const most = Math.max(1, ...found.telegrams);
    const part = (found.end - found.oldest) / found.telegrams.length;
    ctx.fillStyle = colour("--faint");
    found.telegrams.forEach((count, n) => {
        const tall = count && (0.25 + (0.75 * count) / most) * height * 0.5;
        const from = at(found.oldest + n * part);
        ctx.fillRect(from, height - tall, Math.max(1, at(found.oldest + (n + 1) * part) - from), tall);
    });
    for (const mark of found.marks) {
        ctx.fillStyle = colour(colourOf(mark));
        ctx.fillRect(at(mark.clock), 0, 1.5, height * 0.55);
    }
}

const seconds = (clock: number): string => `${(clock / hertz()).toFixed(3)} s`;

/** Branches that can be reached, where there is more than one. */
function Branches() {
    const shape = history.value!;
    if (shape.branches.length < 2) return null;
    return (
        <select
            aria-label="Branch"
            title="Branches of the history: the present one, and those that were left"
            value={String(branch.value?.number)}
            onChange={event => {
                const chosen = shape.branches.find(item => String(item.number) === event.currentTarget.value)!;
                if (chosen.number === shape.present && !past.value) return;
                show(chosen.end, chosen.number);
            }}
        >
            {shape.branches.map(item => (
                <option key={item.number} value={String(item.number)}>
                    {item.number === shape.present ? "present" : `left: ${seconds(item.end)}`} · branch {item.number}
                    {item.parent >= 0 ? ` from ${seconds(item.since)}` : ""}
                </option>
            ))}
        </select>
    );
}

export function Scrubber() {
    const track = useRef<HTMLSpanElement>(null);
    const named = useSignal("");
    const shape = history.value;
    const shown = branch.value;
    const { oldest, last } = range.value;
    const number = shown?.number ?? -1;
    useEffect(() => {
        if (number < 0) return;
        void readMarks();
        const timer = setInterval(() => document.hidden || past.peek() || void readMarks(), EACH_MS);
        return () => clearInterval(timer);
    }, [number]);
    if (!can.value.history || !shape || !shown) return null;
    const name = (event: PointerEvent) => {
        const box = track.current!.getBoundingClientRect();
        const place = (clock: number): number => ((clock - oldest) / (last - oldest)) * box.width;
        const x = event.clientX - box.left;
        const near = marks.value?.marks.filter(mark => Math.abs(place(mark.clock) - x) <= NEAR) ?? [];
        named.value = near
            .slice(-3)
            .map(mark => `${seconds(mark.clock)} ${mark.motor >= 0 ? `motor ${mark.motor} ` : ""}${mark.text}`)
            .join(" · ");
    };
    const clock = past.value ? time.value.clock : last;
    return (
        <div class={`scrubber ${past.value ? "past" : ""}`} role="group" aria-label="History">
            <span title="Drag to show a past moment">history</span>
            <span class="track" ref={track} onPointerMove={name} onPointerLeave={() => (named.value = "")}>
                {named.value && <span class="scrub-name">{named.value}</span>}
                <Sketch draw={draw} />
                <input
                    type="range"
                    aria-label="Moment"
                    aria-valuetext={seconds(clock)}
                    min={oldest}
                    max={last}
                    step={hertz() / 1000}
                    value={clock}
                    onInput={event => show(Number(event.currentTarget.value))}
                />
            </span>
            <output>{seconds(clock)}</output>
            <Branches />
            <button
                {...unless(!past.value && "The present is shown", "Show the present again (Alt+F2)")}
                onClick={() => void leave()}
            >
                Live
            </button>
        </div>
    );
}
