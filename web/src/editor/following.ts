// What a view shows of the page's state: breakpoints, addresses, the executed line, coverage, values, diagnostics.
import { setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { Compartment, type EditorState } from "@codemirror/state";
import { EditorView } from "@codemirror/view";
import { computed, effect, signal } from "@preact/signals";
import { halted, held, loaded, program, running } from "../logic/app";
import { assembled } from "../logic/build";
import { coverage } from "../logic/coverage";
import { breakpoints, hitsOf, placeOf } from "../logic/debugger";
import { active, goal, isProgram, openFile, problems, type TextDocument } from "../logic/documents";
import { followOn, liveValues } from "../logic/live";
import type { Problem } from "../wire";
import { check } from "./bench";
import { putAddresses, putBreakpoints, putExecution } from "./gutters";
import { putCoverage, putValues } from "./marks";
import { languageServer, lspExtension } from "./server";

/** Where the language server comes into a view, whenever it comes: text, undo history and cursor stay. */
export const language = new Compartment();
/** The view that has or last had the focus. */
export const currentView = signal<EditorView | null>(null);

function toDiagnostic(problem: Problem, state: EditorState): Diagnostic {
    const { doc } = state;
    const position = (line: number, column: number) => {
        const found = doc.line(Math.min(Math.max(line, 1), doc.lines));
        return Math.min(found.from + Math.max(column - 1, 0), found.to);
    };
    const { place } = problem;
    const from = position(place.line, place.column);
    return {
        from,
        to: Math.max(position(place.end_line, place.end_column), from),
        severity: problem.severity === "information" ? "info" : problem.severity,
        message: problem.text,
        source: problem.code,
    };
}

const counter = computed(() => program.value.counter);
const underWay = computed(() => running.value || held.value || counter.value > 0);
/** The line that the module executes, while it executes something; registers change far more often. */
const executed = computed(() => (underWay.value ? loaded.value?.lines[counter.value] : undefined));

/** Keeps marks of a view in step with the page's state. */
export function follow(document: TextDocument, view: EditorView): (() => void)[] {
    return [
        document.path.endsWith(".toml") ? check(document) : () => {},
        effect(() => {
            void languageServer.value;
            view.dispatch({
                effects: language.reconfigure(isProgram(document.path) ? lspExtension(document.path) : []),
            });
        }),
        effect(() => {
            const lines = breakpoints.value
                .filter(point => point.path === document.path)
                .map(point => {
                    const found = placeOf(point);
                    return {
                        ...point,
                        verified: found?.verified ?? false,
                        reason: found?.message ?? "",
                        met: hitsOf(point),
                    };
                });
            view.dispatch({ effects: putBreakpoints.of(lines) });
        }),
        effect(() => {
            const addresses = new Map<number, number>();
            const own = assembled.value.get(document.path)?.lines;
            const lines = own ?? loaded.value?.lines.map(line => (line.path === document.path ? line.line : 0)) ?? [];
            lines.forEach((line, address) => {
                if (line && !addresses.has(line)) addresses.set(line, address);
            });
            view.dispatch({ effects: putAddresses.of(addresses) });
        }),
        effect(() => {
            const line = executed.value;
            const here = line && line.path === document.path && line.line > 0;
            view.dispatch({ effects: putExecution.of(here ? { line: line.line, held: halted.value } : null) });
        }),
        effect(() => {
            view.dispatch({ effects: putCoverage.of(coverage.value?.get(document.path) ?? null) });
        }),
        effect(() => {
            view.dispatch({ effects: putValues.of(liveValues.value.get(document.path) ?? new Map()) });
        }),
        effect(() => {
            if (languageServer.value && isProgram(document.path)) return;
            const list = problems.value.get(document.path) ?? [];
            view.dispatch(
                setDiagnostics(
                    view.state,
                    list.map(problem => toDiagnostic(problem, view.state)),
                ),
            );
        }),
        effect(() => {
            const wish = goal.value;
            if (!wish || wish.path !== document.path) return;
            goal.value = null;
            const line = view.state.doc.line(Math.min(Math.max(1, wish.line), view.state.doc.lines));
            const at = Math.min(line.from + wish.column - 1, line.to);
            const show = () => {
                view.dispatch({ selection: { anchor: at }, effects: EditorView.scrollIntoView(at, { y: "center" }) });
                if (wish.caret()) view.focus();
            };
            // Coming from a page that is no file, the editor is hidden until that page has gone.
            if (view.dom.offsetParent) queueMicrotask(show);
            else setTimeout(show, SHOWN_MS);
        }),
    ];
}

/** Bring the line that the module executes into view, opening its file if needed. */
async function showExecuted(): Promise<void> {
    const line = loaded.peek()?.lines[counter.peek()];
    if (!line?.line) return;
    if (active.peek() !== line.path && !(await openFile(line.path))) return;
    const view = currentView.peek();
    if (!view || line.line > view.state.doc.lines) return;
    view.dispatch({ effects: EditorView.scrollIntoView(view.state.doc.line(line.line).from, { yMargin: 60 }) });
}

/** The debugger held the program. */
effect(() => {
    if (!held.value) return;
    void counter.value;
    void showExecuted();
});

/** Until an editor that was hidden is on screen. */
const SHOWN_MS = 50;
/** Between two moves of a view that follows the running line. */
const FOLLOW_MS = 200;
let followTimer = 0;
effect(() => {
    if (!followOn.value || !running.value) return;
    void executed.value;
    if (followTimer) return;
    followTimer = window.setTimeout(() => {
        followTimer = 0;
        void showExecuted();
    }, FOLLOW_MS);
});
