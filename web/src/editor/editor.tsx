// The code editor: one CodeMirror view a document, kept while its tab is open.
import { acceptCompletion, autocompletion, closeCompletion, completionKeymap } from "@codemirror/autocomplete";
import {
    defaultKeymap,
    deleteLine,
    history,
    historyKeymap,
    indentWithTab,
    redo,
    toggleComment,
    undo,
} from "@codemirror/commands";
import { bracketMatching } from "@codemirror/language";
import { lintKeymap, nextDiagnostic, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { highlightSelectionMatches, openSearchPanel, search, searchKeymap } from "@codemirror/search";
import { Annotation, Compartment, EditorState, Prec, type Extension } from "@codemirror/state";
import {
    EditorView,
    drawSelection,
    dropCursor,
    highlightActiveLine,
    highlightActiveLineGutter,
    highlightSpecialChars,
    keymap,
    lineNumbers,
    rectangularSelection,
} from "@codemirror/view";
import { computed, effect, signal, useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { halted, held, loaded, program, running, tables, welcome } from "../logic/app";
import { assembled } from "../logic/build";
import { coverage } from "../logic/coverage";
import { breakpoints, carryBreakpoints, hitsOf, placeOf, setBreakpoints, type Breakpoint } from "../logic/debugger";
import {
    active,
    documents,
    goal,
    isProgram,
    openFile,
    problems,
    reload,
    save,
    type TextDocument,
} from "../logic/documents";
import { followOn, liveValues, visibleLines } from "../logic/live";
import type { Problem } from "../wire";
import { Icon } from "../widgets/icons";
import { breakpointsOf, gutters, putAddresses, putBreakpoints, putExecution } from "./gutters";
import { check, toml } from "./bench";
import { colours, tmcl } from "./language";
import { marks, putCoverage, putValues } from "./marks";
import { searchPanel } from "./search";
import { languageServer, lspExtension } from "./server";
import { theme } from "./theme";
import { hoversEnd } from "./hovers";
import { who } from "./who";

const fromOutside = Annotation.define<boolean>();
/** Where the language server comes into a view, whenever it comes: text, undo history and cursor stay. */
const language = new Compartment();
/** The view that has or last had the focus. */
export const currentView = signal<EditorView | null>(null);
const editedBreakpoint = signal<{ path: string; line: number; x: number; y: number } | null>(null);

function toggleBreakpoint(path: string, line: number): void {
    const others = breakpoints.value.filter(point => point.path !== path || point.line !== line);
    const added: Breakpoint[] =
        others.length < breakpoints.value.length ? [] : [{ path, line, condition: "", hits: "", log: "" }];
    void setBreakpoints([...others, ...added]);
}

/** Toggles a breakpoint where the cursor is. */
export function toggleHere(): void {
    const view = currentView.value;
    if (view) toggleBreakpoint(active.value, view.state.doc.lineAt(view.state.selection.main.head).number);
}

function extensions(document: TextDocument): Extension {
    return [
        history(),
        drawSelection(),
        dropCursor(),
        highlightSpecialChars(),
        rectangularSelection(),
        highlightActiveLine(),
        highlightSelectionMatches(),
        bracketMatching(),
        search({ top: true, createPanel: searchPanel }),
        EditorState.allowMultipleSelections.of(true),
        EditorState.tabSize.of(4),
        gutters(
            line => toggleBreakpoint(document.path, line),
            (line, at) => {
                const box = at.getBoundingClientRect();
                editedBreakpoint.value = { path: document.path, line, x: box.right, y: box.bottom };
            },
        ),
        lineNumbers(),
        marks((first, last) => active.peek() === document.path && see(document.path, first, last)),
        highlightActiveLineGutter(),
        isProgram(document.path) ? [autocompletion({ icons: false }), tmcl(tables.value)] : toml(colours),
        who(),
        hoversEnd(),
        language.of([]),
        Prec.high(
            keymap.of([
                { key: "Tab", run: acceptCompletion },
                { key: "Ctrl-y", run: deleteLine },
                { key: "Mod-/", run: toggleComment },
                { key: "Mod-Shift-z", run: redo },
                { key: "Mod-z", run: undo },
                { key: "Ctrl-F8", run: nextDiagnostic },
            ]),
        ),
        keymap.of([
            ...searchKeymap,
            ...historyKeymap,
            ...completionKeymap,
            ...lintKeymap,
            indentWithTab,
            ...defaultKeymap,
        ]),
        EditorView.contentAttributes.of({ "aria-label": `Source text ${document.path}`, spellcheck: "false" }),
        theme,
        EditorView.updateListener.of(update => {
            if (update.focusChanged && update.view.hasFocus) currentView.value = update.view;
            if (!update.docChanged) return;
            if (!update.transactions.some(transaction => transaction.annotation(fromOutside)))
                document.text.value = update.state.doc.toString();
            followEdits(document.path, update.view);
        }),
    ];
}

function see(path: string, first: number, last: number): void {
    const before = visibleLines.peek();
    if (before.path !== path || before.first !== first || before.last !== last)
        visibleLines.value = { path, first, last };
}

/** Breakpoints move with their lines while the text is edited. */
function followEdits(path: string, view: EditorView): void {
    const here = breakpoints.value.filter(point => point.path === path);
    if (!here.length) return;
    const now = breakpointsOf(view.state);
    if (now.length === here.length && now.every(point => here.some(other => other.line === point.line))) return;
    carryBreakpoints(
        path,
        now.map(({ line, condition, hits, log }) => ({ path, line, condition, hits, log })),
    );
}

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

function View({ document }: { document: TextDocument }) {
    const host = useRef<HTMLDivElement>(null);
    const shown = useSignal(false);
    const view = useRef<EditorView | null>(null);
    useSignalEffect(() => {
        shown.value = active.value === document.path;
        if (!shown.value || !view.current) return;
        currentView.value = view.current;
        const { doc } = view.current.state;
        const { from, to } = view.current.viewport;
        see(document.path, doc.lineAt(from).number, doc.lineAt(to).number);
    });
    useEffect(() => {
        const created = new EditorView({
            state: EditorState.create({ doc: document.text.peek(), extensions: extensions(document) }),
            parent: host.current!,
        });
        view.current = created;
        if (active.peek() === document.path) {
            currentView.value = created;
            see(document.path, 1, created.state.doc.lineAt(created.viewport.to).number);
        }
        document.show = text => {
            if (created.state.doc.toString() === text) return;
            const { head } = created.state.selection.main;
            created.dispatch({
                changes: { from: 0, to: created.state.doc.length, insert: text },
                selection: { anchor: Math.min(head, created.state.toText(text).length) },
                annotations: fromOutside.of(true),
            });
        };
        const stops = follow(document, created);
        return () => {
            for (const stop of stops) stop();
            created.destroy();
            if (currentView.peek() === created) currentView.value = null;
        };
    }, [document]);
    return <div class="code" hidden={!shown.value} ref={host} data-path={document.path} />;
}

const counter = computed(() => program.value.counter);
const underWay = computed(() => running.value || held.value || counter.value > 0);
/** The line that the module executes, while it executes something; registers change far more often. */
const executed = computed(() => (underWay.value ? loaded.value?.lines[counter.value] : undefined));

/** Keeps marks of a view in step with the page's state. */
function follow(document: TextDocument, view: EditorView): (() => void)[] {
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
                view.focus();
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

function OutsideNotice({ document }: { document: TextDocument }) {
    const state = document.outside.value;
    if (!state) return null;
    return (
        <div class="outside" role="alert">
            <Icon name="alert" />
            {state === "changed" ? (
                <>
                    <span>This file was changed outside. Your text here is different.</span>
                    <button onClick={() => void reload(document)}>Take the file</button>
                    <button onClick={() => void save(document, true)}>Keep mine and save</button>
                </>
            ) : (
                <>
                    <span>This file was deleted outside. Its text is kept here.</span>
                    <button onClick={() => void save(document, true)}>Save it again</button>
                </>
            )}
        </div>
    );
}

function BreakpointEditor() {
    const place = editedBreakpoint.value;
    if (!place) return null;
    const found = breakpoints.value.find(point => point.path === place.path && point.line === place.line);
    const start: Breakpoint = found ?? { path: place.path, line: place.line, condition: "", hits: "", log: "" };
    const others = breakpoints.value.filter(point => point !== found);
    const close = () => (editedBreakpoint.value = null);
    const submit = (event: Event) => {
        event.preventDefault();
        const data = new FormData(event.currentTarget as HTMLFormElement);
        const text = (name: string) => String(data.get(name) ?? "").trim();
        void setBreakpoints([
            ...others,
            { ...start, condition: text("condition"), hits: text("hits"), log: text("log") },
        ]);
        close();
    };
    return (
        <form
            class="popover breakpoint-editor"
            style={{ left: `${place.x}px`, top: `${place.y}px` }}
            onSubmit={submit}
            onKeyDown={event => event.key === "Escape" && close()}
        >
            <h3>Breakpoint at line {place.line}</h3>
            <label>
                Hold when
                <input name="condition" defaultValue={start.condition} placeholder="accumulator &gt; 100" autofocus />
            </label>
            <label>
                at hits
                <input name="hits" defaultValue={start.hits} placeholder="5, == 3, % 10" />
            </label>
            <label>
                or only tell
                <input name="log" defaultValue={start.log} placeholder="round {gp[0]}" />
            </label>
            <div class="row">
                <button type="submit" class="primary">
                    Set
                </button>
                <button
                    type="button"
                    onClick={() => {
                        void setBreakpoints(others);
                        close();
                    }}
                >
                    Remove
                </button>
                <button type="button" onClick={close}>
                    Cancel
                </button>
            </div>
        </form>
    );
}

export const find = (): void => void (currentView.value && openSearchPanel(currentView.value));
export const closeCompletions = (): void => void (currentView.value && closeCompletion(currentView.value));

export function Editor() {
    if (!welcome.value) return null;
    const document = documents.value.get(active.value);
    return (
        <>
            {document && <OutsideNotice document={document} />}
            {[...documents.value.values()].map(item => (
                <View key={item.path} document={item} />
            ))}
            <BreakpointEditor />
        </>
    );
}
