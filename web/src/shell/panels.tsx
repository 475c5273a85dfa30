// The panels at the right of the editor and below it, with their tabs.
import { can, held, online, welcome } from "../logic/app";
import { perform } from "../logic/actions";
import { problemCount } from "../logic/documents";
import {
    bottomTall,
    layout,
    lowerPanel,
    right,
    roomy,
    second,
    type BottomPanel,
    type RightPanel,
} from "../logic/layout";
import { past } from "../logic/past";
import { Axes } from "../panels/axes";
import { Bench } from "../panels/bench";
import { Direct } from "../panels/direct";
import { Log } from "../panels/log";
import { Machine } from "../panels/machine";
import { Outline } from "../panels/outline";
import { Plot } from "../panels/plot";
import { Problems } from "../panels/problems";
import { Program } from "../panels/program";
import { IconButton, Splitter, walk } from "../widgets/basics";

type Panels<T extends string> = Record<T, [string, () => preact.JSX.Element]>;
type RightName = Exclude<RightPanel, "">;

const RIGHT: Panels<RightName> = {
    axes: ["Axes", Axes],
    machine: ["Machine", Machine],
    bench: ["Bench", Bench],
    program: ["Program", Program],
    outline: ["Outline", Outline],
};
const AXES_ALONE = { axes: RIGHT.axes };
const BESIDE = { machine: RIGHT.machine, bench: RIGHT.bench, program: RIGHT.program, outline: RIGHT.outline };
const BOTTOM: Panels<Exclude<BottomPanel, "">> = {
    plot: ["Plot", Plot],
    direct: ["Direct mode", Direct],
    log: ["Telegrams", Log],
    problems: ["Problems", Problems],
};
const SECOND_WIDTH = 404;
/** The least height of the lower panel, and of what stays above it. */
const LOWER_HEIGHT = [120, 220] as const;

/** A real module has no bench to draw. */
const drawable = (name: string): boolean => can.value.bench || name !== "machine";
const instead = <T extends string>(name: T): T | "bench" => (drawable(name) ? name : "bench");
const beside = (): boolean => roomy.value && right.value !== "";
/** Whether the lower panel leaves no room for the editor. */
export const coversEditor = (): boolean => bottomTall.value && lowerPanel().value !== "";

type Size = "filesWidth" | "rightWidth" | "bottomHeight";

/** Change a size of the layout by what a splitter was dragged. */
export function resize(size: Size, delta: number, low: number, high: number): void {
    const changed = Math.max(low, Math.min(high, layout.value[size] + delta));
    layout.value = { ...layout.value, [size]: changed };
}

/** Widths of files, editor and right panels, for the grid of the page. */
export function columns(): string {
    const { files, filesWidth, rightWidth } = layout.value;
    const left = files ? `${filesWidth}px ` : "0 ";
    return `${left}minmax(0, 1fr) ${right.value ? `${rightWidth}px` : "0"}${beside() ? ` ${SECOND_WIDTH}px` : ""}`;
}

function PanelTabs<T extends string>({
    panels,
    value,
    set,
    label,
}: {
    panels: Record<T, [string, unknown]>;
    value: string;
    set: (name: T) => void;
    label: string;
}) {
    const { errors, warnings } = problemCount.value;
    const entries = (Object.entries(panels) as [T, [string, unknown]][]).filter(([name]) => drawable(name));
    return (
        <div class="panel-tabs" role="tablist" aria-label={label} onKeyDown={walk}>
            {entries.map(([name, [title]]) => (
                <button
                    key={name}
                    role="tab"
                    aria-selected={value === name}
                    tabIndex={value === name || !value ? 0 : -1}
                    class={value === name ? "on" : ""}
                    onClick={() => set(name)}
                >
                    {title}
                    {name === "problems" && errors + warnings > 0 && (
                        <span class={`badge ${errors ? "bad" : "warn"}`}>{errors || warnings}</span>
                    )}
                    {name === "program" && held.value && <span class="badge warn">held</span>}
                </button>
            ))}
        </div>
    );
}

export function LowerPanel() {
    const lower = lowerPanel();
    const Bottom = lower.value ? BOTTOM[lower.value][1] : null;
    const tall = coversEditor();
    const [least, left] = LOWER_HEIGHT;
    return (
        <section
            class="bottom"
            aria-label="Lower panel"
            style={{ height: !Bottom ? "auto" : tall ? "100%" : `${layout.value.bottomHeight}px` }}
        >
            {Bottom && !tall && (
                <Splitter
                    vertical={false}
                    size={layout.value.bottomHeight}
                    label="Height of the lower panel"
                    onDrag={delta => resize("bottomHeight", -delta, least, window.innerHeight - left)}
                />
            )}
            <div class="panel-head">
                <PanelTabs panels={BOTTOM} value={lower.value} set={name => (lower.value = name)} label="Lower panel" />
                <span class="gap" />
                {Bottom && (
                    <IconButton
                        icon={tall ? "down" : "up"}
                        size={13}
                        title={tall ? "Smaller" : "As tall as possible"}
                        label="Toggle full height"
                        onClick={() => (bottomTall.value = !bottomTall.value)}
                    />
                )}
                <IconButton
                    icon={Bottom ? "minus" : "plus"}
                    size={13}
                    title="Show or hide (Ctrl+J)"
                    label="Toggle lower panel"
                    onClick={() => perform("toggle_bottom")}
                />
            </div>
            {Bottom && (
                <div class="panel-body">
                    <Bottom />
                </div>
            )}
        </section>
    );
}

/** The panel at the right; with room enough the axes stay there. */
export function RightPanels() {
    if (!right.value) return <div />;
    return beside() ? (
        <>
            <Side label="Right panel" panels={AXES_ALONE} shown="axes" set={name => (right.value = name)} wide />
            <Side
                label="Second right panel"
                panels={BESIDE}
                shown={instead(second.value)}
                set={name => (second.value = name)}
            />
        </>
    ) : (
        <Side label="Right panel" panels={RIGHT} shown={instead(right.value)} set={name => (right.value = name)} wide />
    );
}

function Side<T extends RightName>(props: {
    label: string;
    panels: Panels<T>;
    shown: T;
    set: (name: T) => void;
    wide?: boolean;
}) {
    const [title, Panel] = RIGHT[props.shown];
    const offline = !!welcome.value && !online.value;
    return (
        <aside class="right" aria-label={props.label}>
            {props.wide && (
                <Splitter
                    vertical
                    size={layout.value.rightWidth}
                    label="Width of the right panel"
                    onDrag={delta => resize("rightWidth", -delta, 330, 760)}
                />
            )}
            <div class="panel-head">
                <PanelTabs panels={props.panels} value={props.shown} set={props.set} label={props.label} />
            </div>
            <div
                class="panel-body"
                role="tabpanel"
                aria-label={title}
                inert={offline || (past.value && props.shown !== "program")}
            >
                <Panel />
            </div>
        </aside>
    );
}
