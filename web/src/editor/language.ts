// Highlighting of TMCL; the words come from the command table.
import { HighlightStyle, StreamLanguage, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { tags } from "@lezer/highlight";
import type { Extension } from "@codemirror/state";
import type { Tables } from "../wire";

type Token =
    | "comment"
    | "keyword"
    | "operatorKeyword"
    | "atom"
    | "number"
    | "labelName"
    | "variableName.definition"
    | "variableName"
    | "operator"
    | "meta"
    | "invalid"
    | "function"
    | null;

interface Place {
    /** What the line has had so far. */
    seen: "nothing" | "command" | "include";
    jump: boolean;
}

const JUMPS = new Set(["JC", "JA", "CSUB"]);
const NAME = /^[A-Za-z_]\w*/;

export function tmcl(tables: Tables): Extension {
    const mnemonics = new Set(tables.commands.map(row => row.mnemonic));
    const sisters = new Set(tables.sister_commands);
    const functions = new Set(tables.functions);
    const words = new Set(
        tables.commands.flatMap(row => row.operands.flatMap(operand => operand.words.map(word => word.text))),
    );
    const language = StreamLanguage.define<Place>({
        name: "tmcl",
        startState: () => ({ seen: "nothing", jump: false }),
        languageData: { commentTokens: { line: "//" } },
        token(stream, place): Token {
            if (stream.sol()) {
                place.seen = "nothing";
                place.jump = false;
            }
            if (stream.eatSpace()) return null;
            if (stream.match("//")) {
                stream.skipToEnd();
                return "comment";
            }
            if (place.seen === "include") {
                stream.skipToEnd();
                return "atom";
            }
            if (stream.match(/^#\w+/)) {
                place.seen = "include";
                return "meta";
            }
            if (stream.match(/^(\$[0-9a-f]+|%[01]+|\d+(\.\d+)?(e[+-]?\d+)?)/i)) return "number";
            if (stream.match(NAME)) return word(stream.current(), stream.peek() ?? "", place, stream);
            return stream.next()!.match(/[-+*/^=()]/) ? "operator" : null;
        },
    });

    function word(text: string, next: string, place: Place, stream: { match(p: RegExp, c?: boolean): unknown }): Token {
        const upper = text.toUpperCase();
        if (place.seen === "nothing") {
            if (next === ":") return "labelName";
            if (stream.match(/^\s*=/, false)) return "variableName.definition";
            place.seen = "command";
            place.jump = JUMPS.has(upper);
            return mnemonics.has(upper) ? "keyword" : sisters.has(upper) ? "invalid" : "variableName";
        }
        if (words.has(upper)) return "operatorKeyword";
        if (functions.has(upper) && next === "(") return "function";
        return place.jump ? "labelName" : "variableName";
    }
    return [language, colours, indentUnit.of("    ")];
}

const COLOURS = HighlightStyle.define([
    { tag: tags.comment, color: "var(--syntax-comment)", fontStyle: "italic" },
    { tag: tags.keyword, color: "var(--syntax-command)", fontWeight: "600" },
    { tag: tags.operatorKeyword, color: "var(--syntax-word)" },
    { tag: tags.number, color: "var(--syntax-number)" },
    { tag: tags.labelName, color: "var(--syntax-label)" },
    { tag: tags.variableName, color: "var(--syntax-name)" },
    { tag: tags.definition(tags.variableName), color: "var(--syntax-name)" },
    { tag: tags.function(tags.variableName), color: "var(--syntax-word)" },
    { tag: tags.operator, color: "var(--muted)" },
    { tag: tags.atom, color: "var(--syntax-label)" },
    { tag: tags.meta, color: "var(--syntax-word)" },
    { tag: tags.invalid, color: "var(--bad)", textDecoration: "underline wavy" },
]);

/** Of all languages here. */
export const colours: Extension = syntaxHighlighting(COLOURS);
