// The status bar: the program, other hosts, the history, problems.
import { computed } from "@preact/signals";
import { languageServer } from "../editor/server";
import { can, programKnown, shownProgram, stale, tables, time, timePaused, welcome, windows } from "../logic/app";
import { assembled, busy, changedSinceDownload } from "../logic/build";
import { problemCount, target } from "../logic/documents";
import { lowerPanel } from "../logic/layout";
import { short } from "../logic/units";
import { HistoryMemory } from "../panels/past";
import { programText } from "../panels/program";
import { TourOffer } from "../panels/tour";
import { PROGRAM_FLAGS } from "../wire";

const reached = computed(() => (timePaused.value ? "time held" : `${short(time.value.speed)}×`));

export function StatusBar() {
    const { counter, state, paused, accumulator, x, flags } = shownProgram.value;
    const size = assembled.value.get(target.value)?.listing?.lines.length;
    return (
        <footer class="status-bar">
            <span class={`pill ${paused ? "warn" : state === 1 ? "good" : ""}`}>{programText()}</span>
            <span>
                at <b>{programKnown("counter") && !stale.value ? counter : "\u2013"}</b>
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
                    module holds another text
                </span>
            )}
            {busy.value && <span class="pill">{busy.value}…</span>}
            <span class="gap" />
            {welcome.value?.links.map(link => (
                <span key={link} class="mono" title="Other hosts reach the module here; their telegrams are in the log">
                    {link}
                </span>
            ))}
            {can.value.bench && <span title="Virtual seconds per second, as reached">{reached}</span>}
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
                <span title="Completion, hover texts and marked errors">
                    {languageServer.value ? "language server" : "language server…"}
                </span>
            )}
            <TourOffer />
            {windows.value > 1 && <span title="Windows that show this module">{windows.value} windows</span>}
        </footer>
    );
}
