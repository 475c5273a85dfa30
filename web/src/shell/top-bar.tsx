// The tool bar: what the module is, running, building, time, STOP ALL.
import { computed, effect } from "@preact/signals";
import { action, perform } from "../logic/actions";
import { can, connection, reachable, shownSeconds, stale, timePaused, welcome } from "../logic/app";
import { active } from "../logic/documents";
import { drawer, layout } from "../logic/layout";
import { clockText } from "../logic/units";
import { TimeControls } from "../panels/bench";
import { ActionButton, IconButton } from "../widgets/basics";
import { unless } from "../logic/hindrance";

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

export function TopBar() {
    const model = welcome.value?.model;
    return (
        <header class="top">
            <IconButton
                icon="menu"
                label="Files and pages"
                expanded={drawer.value || layout.value.files}
                title="Files and pages (Ctrl+B)"
                onClick={toggleFiles}
            />
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
                {...unless(action("stop_all").hindrance!(), "Stop the program and all motors (F10)")}
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
