// A trigger: the picture stands around the moment when a curve crosses a level, or something happens.
import { signal, useSignal } from "@preact/signals";
import { notify, onServerEvent, sampleListeners, tables } from "../../logic/app";
import { LocalNumber } from "../../widgets/fields";
import { Menu } from "../../widgets/basics";
import type { ShownCurve } from "./curves";

type Edge = "rising" | "falling" | "above" | "below" | "event";
const WORDS: Record<Edge, string> = {
    rising: "a curve rises through",
    falling: "a curve falls through",
    above: "a curve is at or above",
    below: "a curve is at or below",
    event: "something happens (program, switch, power)",
};

/** Whether a value after another one fires a trigger; the one before is NaN where none was known. */
function fires(edge: Edge, level: number, before: number, value: number): boolean {
    switch (edge) {
        case "rising":
            return before < level && value >= level;
        case "falling":
            return before > level && value <= level;
        case "above":
            return value >= level;
        case "below":
            return value <= level;
        default:
            return false;
    }
}
interface Trigger {
    column: number;
    title: string;
    level: number;
    edge: Edge;
    before: number;
}

const armed = signal<Trigger | null>(null);
/** The time at which the trigger has fired; null until it does. */
export const fired = signal<number | null>(null);

function fire(time: number, what: string): void {
    armed.value = null;
    fired.value = time;
    notify("information", `Trigger at ${time.toFixed(3)} s: ${what}.`);
}

sampleListeners.add(row => {
    const trigger = armed.peek();
    if (!trigger || trigger.edge === "event") return;
    const value = row[trigger.column]!;
    if (!Number.isFinite(value)) return;
    const { before, level, edge } = trigger;
    trigger.before = value;
    if (!fires(edge, level, before, value)) return;
    fire(row[0]!, `${trigger.title} ${edge} ${edge === "rising" || edge === "falling" ? "through " : ""}${level}`);
});

onServerEvent(event => {
    if (event.event === "happened" && armed.peek()?.edge === "event")
        fire(event.clock / tables.value.clock_hz, event.text);
});

export function TriggerMenu({ curves }: { curves: readonly ShownCurve[] }) {
    const column = useSignal(0);
    const level = useSignal<number | null>(0);
    const edge = useSignal<Edge>("rising");
    const chosen = curves.find(curve => curve.column === column.value) ?? curves.find(curve => curve.column > 0);
    const arm = () => {
        if (level.value === null || (!chosen && edge.value !== "event")) return;
        fired.value = null;
        armed.value = {
            column: chosen?.column ?? 0,
            title: chosen?.title ?? "",
            level: level.value,
            edge: edge.value,
            before: NaN,
        };
    };
    return (
        <Menu
            icon="bolt"
            label={armed.value ? "Trigger is armed" : "Trigger"}
            class={`tool ${armed.value ? "on" : ""}`}
        >
            <div class="trigger">
                <label>
                    When{" "}
                    <select
                        aria-label="Trigger on"
                        value={edge.value}
                        onChange={event => (edge.value = event.currentTarget.value as Edge)}
                    >
                        {Object.entries(WORDS).map(([value, words]) => (
                            <option key={value} value={value}>
                                {words}
                            </option>
                        ))}
                    </select>
                </label>
                {edge.value !== "event" && (
                    <>
                        <label>
                            Curve{" "}
                            <select
                                aria-label="Trigger curve"
                                value={String(chosen?.column ?? 0)}
                                onChange={event => (column.value = Number(event.currentTarget.value))}
                            >
                                {curves
                                    .filter(curve => curve.column > 0)
                                    .map(curve => (
                                        <option key={curve.column} value={String(curve.column)}>
                                            {curve.title}
                                        </option>
                                    ))}
                            </select>
                        </label>
                        <label>
                            Level{" "}
                            <LocalNumber
                                label="Trigger level"
                                value={level.value}
                                onInput={value => (level.value = value)}
                            />
                        </label>
                    </>
                )}
                {armed.value ? (
                    <button role="menuitem" onClick={() => (armed.value = null)}>
                        Disarm the trigger
                    </button>
                ) : (
                    <button role="menuitem" class="primary" onClick={arm}>
                        Arm the trigger
                    </button>
                )}
            </div>
        </Menu>
    );
}
