// What says that a past moment is shown, with the ways out; how much memory the history has.
import { can, shownSeconds } from "../logic/app";
import { branch, end, goOn, hertz, history, leave, past, whoWrote } from "../logic/past";
import { IconButton, Menu } from "../widgets/basics";
import { Icon } from "../widgets/icons";
import { offline, runs, unless } from "../logic/hindrance";

export function PastStrip() {
    if (!past.value) return null;
    const number = branch.value?.number ?? 0;
    const left = number !== history.value?.present;
    return (
        <div class="banner past-strip" role="status">
            <Icon name="undo" />
            <span>
                <b>PAST</b> {shownSeconds.value.toFixed(3)} s
                <span class="more">
                    {" "}
                    of {(end.value / hertz()).toFixed(3)} s{left ? `, branch ${number}` : ""}. Time stands still;
                    nothing here acts.
                </span>
            </span>
            <button
                title="Begin a new branch at this moment"
                aria-label="Continue from here"
                onClick={() => void goOn(false)}
            >
                <span>
                    Continue<span class="more"> from here</span>
                </span>
            </button>
            <button class="primary" title="Alt+F2" aria-label="Back to the present" onClick={() => void leave()}>
                <span>
                    Back<span class="more"> to the present</span>
                </span>
            </button>
        </div>
    );
}

/** Beside a value that the debugger can name: shows the moment before its last write. */
export function WhoWrote({ value }: { value: string }) {
    if (!can.value.history) return null;
    const question = `Who wrote ${value}?`;
    return (
        <IconButton
            icon="clock"
            size={12}
            class="who"
            label={question}
            title={`${question} Shows the moment before the last write; the program must be held.`}
            hindrance={offline.value || runs.value}
            onClick={() => void whoWrote(value)}
        />
    );
}

/** The same for several values of one row; `of` says what they are. */
export function WhoWroteOf({ of, values }: { of: string; values: readonly string[] }) {
    if (!can.value.history) return null;
    return (
        <Menu icon="clock" size={12} class="tool who" label={`Who wrote ${of}?`}>
            {values.map(value => (
                <button
                    key={value}
                    role="menuitem"
                    {...unless(offline.value || runs.value, "Shows the moment before the last write")}
                    onClick={() => void whoWrote(value)}
                >
                    {value}
                </button>
            ))}
        </Menu>
    );
}

const MIB = 1 << 20;

export function HistoryMemory() {
    const shape = history.value;
    if (!can.value.history || !shape) return null;
    const branches = shape.branches.length;
    return (
        <span
            title={`Memory of the history${branches > 1 ? `, ${branches} branches` : ""}: the oldest past is given up first`}
        >
            history {(shape.memory / MIB).toFixed(1)} of {shape.limit / MIB} MiB
        </span>
    );
}
