// The page: tool bar, files, editor, panels.
import { computed, effect } from "@preact/signals";
import { render } from "preact";
import { Editor } from "./editor/editor";
import { PROGRAM_FLAGS } from "./wire";
import { action, perform, shownTheme } from "./logic/actions";
import {
    can,
    connection,
    held,
    loaded,
    online,
    programKnown,
    reachable,
    shownProgram,
    stale,
    shownSeconds,
    tables,
    time,
    timePaused,
    welcome,
    windows,
} from "./logic/app";
import { languageServer } from "./editor/server";
import { assembled, busy, changedSinceDownload } from "./logic/build";
import {
    PAGES,
    active,
    activeTab,
    closeTab,
    documents,
    newFile,
    openFile,
    openPage,
    opened,
    problemCount,
    restore,
    tabs,
    target,
    type PageName,
    type Tab,
} from "./logic/documents";
import {
    bottomTall,
    drawer,
    layout,
    lowerPanel,
    right,
    roomy,
    second,
    type BottomPanel,
    type RightPanel,
} from "./logic/layout";
import { place } from "./logic/modules";
import { past } from "./logic/past";
import { clockText, short } from "./logic/units";
import { Axes } from "./panels/axes";
import { Bench, TimeControls } from "./panels/bench";
import { Compare } from "./panels/compare";
import { BenchBar } from "./panels/bench-bar";
import { ConnectionPage } from "./panels/connection";
import { Direct } from "./panels/direct";
import { Files } from "./panels/files";
import { Listing } from "./panels/listing";
import { Outline } from "./panels/outline";
import { PromptWindow } from "./panels/prompt";
import { Log } from "./panels/log";
import { Machine } from "./panels/machine";
import { Banner, Confirmation, Notices, Overview, Palette } from "./panels/overlays";
import { ArmedSwitch, MotionStrips } from "./panels/motion";
import { HistoryMemory, PastStrip } from "./panels/past";
import { Parameters } from "./panels/parameters";
import { Plot } from "./panels/plot";
import { Problems } from "./panels/problems";
import { Program, programText } from "./panels/program";
import { Start } from "./panels/start";
import { Tools } from "./panels/tools";
import { Tour, TourOffer } from "./panels/tour";
import { ActionButton, Empty, Splitter, walk } from "./widgets/basics";
import { Icon } from "./widgets/icons";

const reached = computed(() => (timePaused.value ? "time held" : `${short(time.value.speed)}×`));
const clock = computed(() => clockText(shownSeconds.value));

const narrow = matchMedia("(max-width: 860px)");
const toggleFiles = () => (narrow.matches ? (drawer.value = !drawer.value) : perform("toggle_files"));
effect(() => {
    void active.value;
    drawer.value = false;
});

/** Its text changes with every frame, and nothing else does. */
const Clock = () => (
    <span class={`virtual-time ${timePaused.value ? "held" : ""}`} title="Virtual time since power-on">
        {clock}
    </span>
);

function TopBar() {
    const model = welcome.value?.model;
    return (
        <header class="top">
            <button
                class="tool"
                aria-label="Files and pages"
                aria-expanded={drawer.value || layout.value.files}
                title="Files and pages (Ctrl+B)"
                onClick={toggleFiles}
            >
                <Icon name="menu" />
            </button>
            <div class="brand" title={welcome.value ? `${welcome.value.product} · ${welcome.value.module}` : undefined}>
                <i
                    class={`heart ${connection.state.value !== "open" ? connection.state.value : reachable.value && !stale.value ? "open" : "lost"}`}
                    role="img"
                    aria-label={reachable.value && !stale.value ? "The module answers" : "The module does not answer"}
                />
                <b>{!model ? "tmcm34x" : model.known ? model.name : "no module"}</b>
                <span class="muted">{model?.known && `V${model.version.split("V")[1]}`}</span>
            </div>
            <div class="group">
                <ActionButton id="run" label tone="go" />
                <ActionButton id="pause" />
                <ActionButton id="step" />
                <ActionButton id="step_over" />
                {can.value.debug && (
                    <span class="travel">
                        <ActionButton id="step_back" />
                        <ActionButton id="reverse" />
                    </span>
                )}
                <ActionButton id="stop" label />
                <ActionButton id="reset" />
            </div>
            <div class="group">
                <ActionButton id="assemble" label />
                <ActionButton id="download" label />
                <ActionButton id="upload" />
            </div>
            <span class="gap" />
            {can.value.bench && <Clock />}
            <TimeControls />
            <button
                class="stop-all"
                disabled={!action("stop_all").enabled!()}
                title="Stop the program and all motors (F10)"
                onClick={() => perform("stop_all")}
            >
                STOP ALL <kbd>F10</kbd>
            </button>
            <ActionButton id="open" />
            <ActionButton id="theme" />
            <ActionButton id="keys" />
        </header>
    );
}

/** Where the module is, what holds, and the last messages: one line of a fixed height, so that nothing is shifted or covered. */
const Lane = () => (
    <div class="lane" role="region" aria-label="State">
        {welcome.value && (
            <button class="place" title="Connection: this module, and others" onClick={() => openPage("connection")}>
                <span>{place.value}</span>
            </button>
        )}
        <ArmedSwitch />
        <PastStrip />
        <Banner />
        <MotionStrips />
        <span class="gap" />
        <Notices />
    </div>
);

const keyOf = (tab: Tab) => (tab.kind === "file" ? tab.path : `:${tab.kind}`);

function Tabs() {
    return (
        <div class="tabs">
            <div class="tab-list" role="tablist" aria-label="Pages" onKeyDown={walk}>
                {tabs.value.map(tab => {
                    const key = keyOf(tab);
                    const document = documents.value.get(key);
                    const title = tab.kind === "file" ? tab.path.split("/").pop()! : PAGES[tab.kind];
                    return (
                        <div
                            key={key}
                            role="presentation"
                            class={`tab ${active.value === key ? "on" : ""}`}
                            onAuxClick={event => event.button === 1 && closeTab(key)}
                        >
                            <button
                                role="tab"
                                aria-selected={active.value === key}
                                tabIndex={active.value === key ? 0 : -1}
                                title={tab.path}
                                onClick={() => (active.value = key)}
                            >
                                {title}
                                {document?.dirty.value && <i class="dot" title="Not saved" />}
                                {document?.outside.value && <Icon name="alert" size={12} />}
                            </button>
                            <span class="close" title={`Close ${title} (Alt+W)`} onClick={() => closeTab(key)}>
                                <Icon name="close" size={11} />
                            </span>
                        </div>
                    );
                })}
            </div>
            <button class="tool" aria-label="New program" title="New program (Alt+N)" onClick={() => newFile()}>
                <Icon name="plus" size={14} />
            </button>
        </div>
    );
}

const MAIN: Partial<Record<PageName, () => preact.JSX.Element>> = {
    parameters: Parameters,
    tools: Tools,
    listing: Listing,
    compare: Compare,
    connection: ConnectionPage,
    start: Start,
};

function Main() {
    if (!welcome.value)
        return (
            <Empty icon="plug" title={connection.state.value === "connecting" ? "Opening the IDE…" : "No server"}>
                {connection.state.value !== "connecting" && "This page comes to life when the IDE's server answers."}
            </Empty>
        );
    const kind = activeTab.value?.kind;
    const Page = kind && kind !== "file" ? MAIN[kind] : undefined;
    return (
        <>
            {Page && (
                <div class="guarded" inert={!online.value}>
                    <Page />
                </div>
            )}
            <div class="editors" hidden={kind !== "file"}>
                <BenchBar />
                <Editor />
            </div>
            {!activeTab.value && opened.value && <Start />}
        </>
    );
}

const RIGHT: Record<Exclude<RightPanel, "">, [string, () => preact.JSX.Element]> = {
    axes: ["Axes", Axes],
    machine: ["Machine", Machine],
    bench: ["Bench", Bench],
    program: ["Program", Program],
    outline: ["Outline", Outline],
};
const AXES_ALONE = { axes: RIGHT.axes };
const BESIDE = { machine: RIGHT.machine, bench: RIGHT.bench, program: RIGHT.program, outline: RIGHT.outline };
/** A real module has no bench to draw. */
const drawable = (name: string): boolean => can.value.bench || name !== "machine";
const instead = <T extends string>(name: T): T | "bench" => (drawable(name) ? name : "bench");
const SECOND_WIDTH = 404;
const BOTTOM: Record<Exclude<BottomPanel, "">, [string, () => preact.JSX.Element]> = {
    plot: ["Plot", Plot],
    direct: ["Direct mode", Direct],
    log: ["Telegrams", Log],
    problems: ["Problems", Problems],
};

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

function StatusBar() {
    const { counter, state, paused, accumulator, x, flags } = shownProgram.value;
    const size = assembled.value.get(target.value)?.listing?.lines.length;
    return (
        <footer class="status-bar">
            <span class={`pill ${paused ? "warn" : state === 1 ? "good" : ""}`}>{programText()}</span>
            <span>
                at <b>{programKnown("counter") ? counter : "\u2013"}</b>
            </span>
            {can.value.debug && (
                <>
                    <span>
                        accumulator <b>{accumulator}</b>
                    </span>
                    <span>
                        X <b>{x}</b>
                    </span>
                </>
            )}
            {(flags & PROGRAM_FLAGS.eto) !== 0 && <span class="pill warn">ETO</span>}
            {welcome.value && changedSinceDownload() && (
                <span class="pill warn" title="Run downloads the new text">
                    module holds an older text
                </span>
            )}
            {busy.value && <span class="pill">{busy.value}…</span>}
            <span class="gap" />
            {welcome.value?.links.map(link => (
                <span key={link} class="mono" title="Other hosts reach the module here; their telegrams are in the log">
                    {link}
                </span>
            ))}
            {can.value.bench && <span title="Virtual seconds to a second, as reached">{reached}</span>}
            <HistoryMemory />
            {size !== undefined && (
                <span>
                    {size} / {tables.value.program_size}
                </span>
            )}
            <button class="link" onClick={() => (lowerPanel().value = "problems")}>
                {problemCount.value.errors} errors, {problemCount.value.warnings} warnings
            </button>
            {can.value.language_server && (
                <span title="Completion, hover and squiggles">
                    {languageServer.value ? "language server" : "language server…"}
                </span>
            )}
            <TourOffer />
            {windows.value > 1 && <span title="Windows that look at this module">{windows.value} windows</span>}
        </footer>
    );
}

function Page() {
    const sizes = layout.value;
    const set = (part: Partial<typeof sizes>) => (layout.value = { ...layout.value, ...part });
    const clamp = (value: number, low: number, high: number) => Math.max(low, Math.min(high, value));
    const beside = roomy.value && right.value !== "";
    const shown = beside ? "axes" : instead(right.value);
    const Right = shown ? RIGHT[shown][1] : null;
    const shownBeside = instead(second.value);
    const Second = beside ? RIGHT[shownBeside][1] : null;
    const lower = lowerPanel();
    const Bottom = lower.value ? BOTTOM[lower.value][1] : null;
    const columns = `${sizes.files ? `${sizes.filesWidth}px ` : "0 "}minmax(0, 1fr) ${Right ? `${sizes.rightWidth}px` : "0"}${beside ? ` ${SECOND_WIDTH}px` : ""}`;
    return (
        <div
            class={`shell ${welcome.value && !online.value ? "offline" : ""} ${drawer.value ? "drawer" : ""} ${past.value ? "past" : ""}`}
            style={{ gridTemplateColumns: columns }}
        >
            <TopBar />
            <Lane />
            {sizes.files || drawer.value ? (
                <div class="side">
                    <Files />
                    <Splitter
                        vertical
                        size={sizes.filesWidth}
                        label="Width of files"
                        onDrag={delta => set({ filesWidth: clamp(layout.value.filesWidth + delta, 120, 420) })}
                    />
                </div>
            ) : (
                <div />
            )}
            <main class="middle">
                {!(bottomTall.value && Bottom) && (
                    <>
                        <Tabs />
                        <div class="work">
                            <Main />
                        </div>
                    </>
                )}
                <section
                    class="bottom"
                    aria-label="Lower panel"
                    style={{ height: !Bottom ? "auto" : bottomTall.value ? "100%" : `${sizes.bottomHeight}px` }}
                >
                    {Bottom && !bottomTall.value && (
                        <Splitter
                            vertical={false}
                            size={sizes.bottomHeight}
                            label="Height of the lower panel"
                            onDrag={delta =>
                                set({
                                    bottomHeight: clamp(
                                        layout.value.bottomHeight - delta,
                                        120,
                                        window.innerHeight - 220,
                                    ),
                                })
                            }
                        />
                    )}
                    <div class="panel-head">
                        <PanelTabs
                            panels={BOTTOM}
                            value={lower.value}
                            set={name => (lower.value = name)}
                            label="Lower panel"
                        />
                        <span class="gap" />
                        {Bottom && (
                            <button
                                class="tool"
                                title={bottomTall.value ? "Smaller" : "As tall as possible"}
                                aria-label="Toggle full height"
                                onClick={() => (bottomTall.value = !bottomTall.value)}
                            >
                                <Icon name={bottomTall.value ? "down" : "up"} size={13} />
                            </button>
                        )}
                        <button
                            class="tool"
                            title="Show or hide (Ctrl+J)"
                            aria-label="Toggle lower panel"
                            onClick={() => perform("toggle_bottom")}
                        >
                            <Icon name={Bottom ? "minus" : "plus"} size={13} />
                        </button>
                    </div>
                    {Bottom && (
                        <div class="panel-body">
                            <Bottom />
                        </div>
                    )}
                </section>
            </main>
            {Right ? (
                <aside class="right" aria-label="Right panel">
                    <Splitter
                        vertical
                        size={sizes.rightWidth}
                        label="Width of the right panel"
                        onDrag={delta => set({ rightWidth: clamp(layout.value.rightWidth - delta, 330, 760) })}
                    />
                    <div class="panel-head">
                        <PanelTabs
                            panels={beside ? AXES_ALONE : RIGHT}
                            value={shown}
                            set={name => (right.value = name)}
                            label="Right panel"
                        />
                    </div>
                    <div
                        class="panel-body"
                        role="tabpanel"
                        aria-label={RIGHT[shown as keyof typeof RIGHT][0]}
                        inert={(!!welcome.value && !online.value) || (past.value && shown !== "program")}
                    >
                        <Right />
                    </div>
                </aside>
            ) : (
                <div />
            )}
            {Second && (
                <aside class="right" aria-label="Second right panel">
                    <div class="panel-head">
                        <PanelTabs
                            panels={BESIDE}
                            value={shownBeside}
                            set={name => (second.value = name)}
                            label="Second right panel"
                        />
                    </div>
                    <div
                        class="panel-body"
                        role="tabpanel"
                        aria-label={RIGHT[shownBeside][0]}
                        inert={(!!welcome.value && !online.value) || (past.value && second.value !== "program")}
                    >
                        <Second />
                    </div>
                </aside>
            )}
            <StatusBar />
            <div class="scrim" onPointerDown={() => (drawer.value = false)} />
            <Palette />
            <Overview />
            <Confirmation />
            <PromptWindow />
            <Tour />
        </div>
    );
}

let restored = false;
effect(() => {
    if (!welcome.value || restored) return;
    restored = true;
    void restore();
});
void shownTheme;
void [openFile, loaded];
const root = document.getElementById("page")!;
root.replaceChildren();
render(<Page />, root);
connection.open();
