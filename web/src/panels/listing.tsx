// The program as the module holds it, beside the source lines it came from.
import { loaded, program, tables } from "../logic/app";
import { assembled, changedSinceDownload } from "../logic/build";
import { documents, openFile, target } from "../logic/documents";
import type { ListingLine } from "../wire";
import { Empty } from "../widgets/basics";
import { useSignal } from "@preact/signals";

const ROW = 20;

/** The line's own text where its file is open, else its place. */
function source({ path, line }: ListingLine): string {
    const text = documents.value.get(path)?.text.value.split("\n", line)[line - 1];
    return text === undefined ? (line ? `${path}:${line}` : "") : text.trim().replace(/\s+/g, " ");
}

export function Listing() {
    const top = useSignal(0);
    const listing = assembled.value.get(target.value)?.listing ?? loaded.value;
    if (!listing)
        return (
            <Empty icon="list" title="No program">
                {target.value
                    ? "The program has errors: see the problems below."
                    : "Open a program to see its instructions."}
            </Empty>
        );
    const { lines, symbols } = listing;
    const now = listing.identity === loaded.value?.identity ? program.value.counter : -1;
    const labels = new Map(
        symbols.filter(symbol => symbol.kind === "label").map(symbol => [Number(symbol.value), symbol.name]),
    );
    const first = Math.max(0, Math.floor(top.value / ROW) - 10);
    const shown = lines.slice(first, first + 90);
    return (
        <div class="listing">
            <header>
                <h2>{listing.path || "Program"}</h2>
                <span class="muted">
                    {lines.length} of {tables.value.program_size} instructions
                </span>
                {changedSinceDownload() && <span class="pill warn">the module holds another version</span>}
            </header>
            <div class="listing-lines" onScroll={event => (top.value = event.currentTarget.scrollTop)}>
                <div style={{ height: `${lines.length * ROW}px`, position: "relative" }}>
                    {shown.map(line => (
                        <button
                            key={line.address}
                            class={`listing-line ${line.address === now ? "now" : ""}`}
                            style={{ top: `${line.address * ROW}px` }}
                            onClick={() => line.line && openFile(line.path, line.line)}
                        >
                            <span class="address">{line.address}</span>
                            <span class="record">{line.record}</span>
                            <span class="label">{labels.has(line.address) ? `${labels.get(line.address)}:` : ""}</span>
                            <span class="text">{line.text}</span>
                            <span class="place" title={line.line ? `${line.path}:${line.line}` : ""}>
                                {source(line)}
                            </span>
                        </button>
                    ))}
                </div>
            </div>
            {symbols.length > 0 && (
                <aside>
                    <h4>Symbols</h4>
                    <table>
                        <tbody>
                            {symbols.map(symbol => (
                                <tr key={symbol.name}>
                                    <td class={symbol.kind}>{symbol.name}</td>
                                    <td class="value">{symbol.value}</td>
                                </tr>
                            ))}
                        </tbody>
                    </table>
                </aside>
            )}
        </div>
    );
}
