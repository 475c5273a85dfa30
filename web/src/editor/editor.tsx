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
import { lintKeymap, nextDiagnostic } from "@codemirror/lint";
import { highlightSelectionMatches, openSearchPanel, search, searchKeymap } from "@codemirror/search";
import { Annotation, EditorState, Prec, type Extension } from "@codemirror/state";
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
import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { tables, welcome } from "../logic/app";
import { breakpoints, carryBreakpoints } from "../logic/debugger";
import { active, documents, isProgram, reload, save, type TextDocument } from "../logic/documents";
import { visibleLines } from "../logic/live";
import { Icon } from "../widgets/icons";
import { breakpointsOf, gutters } from "./gutters";
import { toml } from "./bench";
import { colours, tmcl } from "./language";
import { marks } from "./marks";
import { searchPanel } from "./search";
import { theme } from "./theme";
import { BreakpointEditor, editedBreakpoint, toggleBreakpoint } from "./breakpoint-editor";
import { currentView, follow, language } from "./following";
import { hoversEnd } from "./hovers";
import { who } from "./who";

const fromOutside = Annotation.define<boolean>();
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
