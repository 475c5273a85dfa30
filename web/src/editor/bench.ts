// Bench files: highlighting of TOML, mistakes as the bench's own reader finds them, completion of keys.
import { autocompletion, type CompletionContext, type CompletionResult } from "@codemirror/autocomplete";
import { StreamLanguage, indentUnit } from "@codemirror/language";
import type { Extension } from "@codemirror/state";
import { effect, signal } from "@preact/signals";
import { connection, online } from "../logic/app";
import { problems, type TextDocument } from "../logic/documents";

const CHECK_MS = 200;
/** Open files that are benches. */
export const benches = signal<ReadonlySet<string>>(new Set());

const language = StreamLanguage.define<{ value: boolean }>({
    name: "toml",
    startState: () => ({ value: false }),
    languageData: { commentTokens: { line: "#" } },
    token(stream, state) {
        if (stream.sol()) state.value = false;
        if (stream.eatSpace()) return null;
        if (stream.match(/^#.*/)) return "comment";
        if (!state.value && stream.match(/^\[+[^\]\n]*\]+/)) return "labelName";
        if (stream.match(/^("""|'''|"([^"\\]|\\.)*"|'[^']*')/)) return "atom";
        if (stream.match(/^(true|false|[-+]?(\d[\d_]*(\.\d+)?(e[-+]?\d+)?|0x[\da-f]+|nan|inf))\b/i)) return "number";
        if (stream.match(/^[\w-]+(?=\s*[.=])/)) return "keyword";
        if (stream.match(/^[\w-]+/)) return "variableName";
        state.value ||= stream.peek() === "=";
        stream.next();
        return "operator";
    },
});

async function source(context: CompletionContext): Promise<CompletionResult | null> {
    const line = context.state.doc.lineAt(context.pos);
    const before = line.text.slice(0, context.pos - line.from);
    const word = context.matchBefore(/["']?\w*/)!;
    if (!context.explicit && word.from === word.to && !/[.={[,]\s*$/.test(before)) return null;
    const place = { line: line.number, column: context.pos - line.from + 1 };
    const list = await connection
        .call({ call: "complete_bench", text: context.state.doc.toString(), ...place })
        .catch(() => []);
    const options = list.map(({ label, detail, meaning, text }) => ({
        label,
        detail,
        info: meaning || undefined,
        apply: text,
    }));
    return { from: word.from, options, validFor: /^["']?\w*$/ };
}

export const toml = (colours: Extension): Extension => [
    language,
    colours,
    indentUnit.of("  "),
    autocompletion({ icons: false, override: [source] }),
];

/** Looks at a file after each change, as long as it is open. */
export function check(document: TextDocument): () => void {
    const { path } = document;
    let timer = 0;
    const look = async (text: string) => {
        const found = await connection.call({ call: "check_bench", path, text }).catch(() => null);
        if (!found || document.text.peek() !== text) return;
        problems.value = new Map(problems.value).set(path, found.problems);
        if (found.bench !== benches.peek().has(path)) {
            const set = new Set(benches.peek());
            if (found.bench) set.add(path);
            else set.delete(path);
            benches.value = set;
        }
    };
    const stop = effect(() => {
        const text = document.text.value;
        clearTimeout(timer);
        if (online.value) timer = window.setTimeout(() => void look(text), CHECK_MS);
    });
    return () => {
        stop();
        clearTimeout(timer);
        const left = new Map(problems.peek());
        left.delete(path);
        problems.value = left;
    };
}
