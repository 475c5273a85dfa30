// The Markdown that the language server writes, as HTML: paragraphs, lists, code, bold text; all else is text.
// It stands in for the library `marked`, which the client of the language server asks for (build.mjs): a twentieth of
// its size, and no HTML of a program's comments becomes HTML of the page.

const ESCAPES: Record<string, string> = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const escaped = (text: string): string => text.replace(/[&<>"]/g, character => ESCAPES[character]!);

const inline = (text: string): string =>
    escaped(text)
        .split(/(`[^`]+`)/)
        .map((part, at) => (at % 2 ? `<code>${part.slice(1, -1)}</code>` : part.replace(/\*\*(.+?)\*\*/g, "<b>$1</b>")))
        .join("");

function block(text: string): string {
    const lines = text.split("\n");
    const first = lines.findIndex(line => line.startsWith("- "));
    if (first < 0) return `<p>${inline(text)}</p>`;
    const items = lines.slice(first).map(line => `<li>${inline(line.replace(/^- /, ""))}</li>`);
    const before = lines.slice(0, first).join("\n");
    return `${before && `<p>${inline(before)}</p>`}<ul>${items.join("")}</ul>`;
}

/** Blocks are parted by empty lines; a fence holds what is between it as it is. */
export function toHtml(text: string): string {
    return text
        .split(/^```.*\n([\s\S]*?)^```$/m)
        .map((part, at) =>
            at % 2
                ? `<pre><code>${escaped(part)}</code></pre>`
                : part
                      .split(/\n{2,}/)
                      .filter(Boolean)
                      .map(lines => block(lines.trim()))
                      .join(""),
        )
        .join("");
}

/** What the client uses of `marked`. */
export class Marked {
    parse = toHtml;
}
