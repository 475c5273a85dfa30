// The search panel of the editor, in the page's own controls.
import {
    SearchQuery,
    closeSearchPanel,
    findNext,
    findPrevious,
    getSearchQuery,
    replaceAll,
    replaceNext,
    setSearchQuery,
} from "@codemirror/search";
import type { EditorView, Panel, ViewUpdate } from "@codemirror/view";

/** Matches that are counted; a longer count would say nothing more. */
const COUNTED = 999;

const OPTIONS = [
    ["caseSensitive", "Aa", "Match case"],
    ["wholeWord", "ab|", "Whole words"],
    ["regexp", ".*", "Regular expression"],
] as const;
type Option = (typeof OPTIONS)[number][0];

function element<K extends keyof HTMLElementTagNameMap>(
    tag: K,
    name: string,
    properties: Partial<HTMLElementTagNameMap[K]>,
    ...children: HTMLElement[]
): HTMLElementTagNameMap[K] {
    const made = Object.assign(document.createElement(tag), { className: name, ...properties });
    made.append(...children);
    return made;
}

/** How many matches there are, and which one is selected. */
function count(view: EditorView, query: SearchQuery): string {
    if (!query.search) return "";
    if (!query.valid) return "not a regular expression";
    const { from } = view.state.selection.main;
    let [at, all] = [0, 0];
    const matches = query.getCursor(view.state) as Iterator<{ from: number; to: number }>;
    for (let next = matches.next(); !next.done && all < COUNTED; next = matches.next()) {
        all++;
        if (next.value.from === from && next.value.to === view.state.selection.main.to) at = all;
    }
    if (!all) return "nothing found";
    return `${at ? `${at} of ` : ""}${all}${all === COUNTED ? " or more" : ""}`;
}

/** Finds and replaces: Enter goes on, Shift+Enter back, Escape closes. */
export function searchPanel(view: EditorView): Panel {
    const options: Record<Option, boolean> = { caseSensitive: false, wholeWord: false, regexp: false };
    const found = element("span", "found", { role: "status" } as Partial<HTMLSpanElement>);
    const field = (label: string, main: boolean) =>
        element("input", "", {
            placeholder: label,
            ariaLabel: label,
            spellcheck: false,
            autocomplete: "off",
            oninput: () => commit(),
            ...(main && { name: "search" }),
        });
    const search = field("Find", true);
    search.setAttribute("main-field", "true");
    const replace = field("Replace", false);
    const button = (text: string, title: string, run: (view: EditorView) => boolean) =>
        element("button", "", { type: "button", textContent: text, title, ariaLabel: title, onclick: () => run(view) });
    const toggles = OPTIONS.map(([option, text, title]) => {
        const made = element("button", "tool text", { type: "button", textContent: text, title, ariaLabel: title });
        made.onclick = () => {
            options[option] = !options[option];
            commit();
        };
        return made;
    });
    const show = () => {
        toggles.forEach((toggle, at) => {
            const on = options[OPTIONS[at]![0]];
            toggle.classList.toggle("on", on);
            toggle.ariaPressed = String(on);
        });
        found.textContent = count(view, getSearchQuery(view.state));
    };
    const commit = () => {
        const query = new SearchQuery({ search: search.value, replace: replace.value, ...options });
        if (!query.eq(getSearchQuery(view.state))) view.dispatch({ effects: setSearchQuery.of(query) });
        show();
    };
    const take = (query: SearchQuery) => {
        search.value = query.search;
        replace.value = query.replace;
        for (const [option] of OPTIONS) options[option] = query[option];
        show();
    };
    const dom = element(
        "div",
        "find",
        {},
        element(
            "div",
            "row",
            {},
            search,
            ...toggles,
            button("\u2191", "Previous match", findPrevious),
            button("\u2193", "Next match", findNext),
            found,
        ),
        element(
            "div",
            "row",
            {},
            replace,
            button("Replace", "Replace this match", replaceNext),
            button("All", "Replace all matches", replaceAll),
        ),
        button("\u00d7", "Close", closeSearchPanel),
    );
    dom.lastElementChild!.className = "tool close";
    dom.onkeydown = event => {
        if (event.key === "Escape") closeSearchPanel(view);
        else if (event.key === "Enter" && event.target === replace) replaceNext(view);
        else if (event.key === "Enter" && event.target === search) (event.shiftKey ? findPrevious : findNext)(view);
        else return;
        event.preventDefault();
    };
    take(getSearchQuery(view.state));
    return {
        dom,
        top: true,
        mount: () => {
            search.focus();
            search.select();
        },
        update: (update: ViewUpdate) => {
            for (const transaction of update.transactions)
                for (const effect of transaction.effects) if (effect.is(setSearchQuery)) take(effect.value);
            if (update.docChanged || update.selectionSet) show();
        },
    };
}
