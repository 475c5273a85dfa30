// Two texts side by side; stretches without a difference are folded.
import { useSignal } from "@preact/signals";
import { comparison, compare } from "../logic/compare";
import { openFile } from "../logic/documents";
import type { Comparison, DiffRow } from "../wire";
import { Empty } from "../widgets/basics";

/** Equal lines that are shown around a difference. */
const AROUND = 3;
const KINDS = { same: "", changed: "changed", gone: "only at the left", new: "only at the right" } as const;

interface Stretch {
    folded: boolean;
    rows: DiffRow[];
}

function stretches(rows: DiffRow[]): Stretch[] {
    const near = rows.map(() => false);
    rows.forEach((row, at) => {
        if (row.kind !== "same") near.fill(true, Math.max(0, at - AROUND), at + AROUND + 1);
    });
    const found: Stretch[] = [];
    rows.forEach((row, at) => {
        const last = found[found.length - 1];
        if (last && last.folded === !near[at]) last.rows.push(row);
        else found.push({ folded: !near[at], rows: [row] });
    });
    return found;
}

export function Compare() {
    const found = comparison.value;
    if (!found)
        return (
            <Empty icon="columns" title="Nothing compared yet">
                <button class="link" onClick={() => compare("module")}>
                    Compare with the module
                </button>{" "}
                or{" "}
                <button class="link" onClick={() => compare("disk")}>
                    with the file on the disk
                </button>
                .
            </Empty>
        );
    const differences = found.rows.filter(row => row.kind !== "same").length;
    return (
        <div class="compare">
            <header>
                <h2>{found.path}</h2>
                <span class={`pill ${found.same ? "good" : "warn"}`}>
                    {found.same
                        ? "no difference"
                        : `${differences} ${differences === 1 ? "line differs" : "lines differ"}`}
                </span>
                <span class="gap" />
                <button onClick={() => compare(found.left === "on the disk" ? "disk" : "module")}>Compare again</button>
            </header>
            <Table found={found} />
        </div>
    );
}

function Table({ found }: { found: Comparison }) {
    return (
        <div class="rows" tabIndex={0} role="region" aria-label="Differences">
            <table>
                <colgroup>
                    <col class="number" />
                    <col />
                    <col class="number" />
                    <col />
                </colgroup>
                <thead>
                    <tr>
                        <th scope="col" colSpan={2}>
                            {found.left}
                        </th>
                        <th scope="col" colSpan={2}>
                            {found.right}
                        </th>
                    </tr>
                </thead>
                {stretches(found.rows).map((stretch, at) => (
                    <Body
                        key={`${found.path} ${at}`}
                        stretch={stretch}
                        path={found.path}
                        lines={found.left === "on the disk"}
                    />
                ))}
            </table>
        </div>
    );
}

function Body({ stretch, path, lines }: { stretch: Stretch; path: string; lines: boolean }) {
    const folded = useSignal(stretch.folded);
    const { rows } = stretch;
    if (folded.value)
        return (
            <tbody class="folded">
                <tr>
                    <td colSpan={4}>
                        <button class="link" onClick={() => (folded.value = false)}>
                            {rows.length} equal {rows.length === 1 ? "line" : "lines"}
                        </button>
                    </td>
                </tr>
            </tbody>
        );
    return (
        <tbody>
            {rows.map((row, at) => (
                <tr key={at} class={row.kind} title={KINDS[row.kind] || undefined}>
                    <td class="number">{row.left < 0 ? "" : row.left}</td>
                    <td class="text">{row.left_text}</td>
                    <td class="number">
                        {row.right < 0 ? (
                            ""
                        ) : lines ? (
                            <button
                                class="link"
                                aria-label={`Line ${row.right}`}
                                onClick={() => openFile(path, row.right)}
                            >
                                {row.right}
                            </button>
                        ) : (
                            row.right
                        )}
                    </td>
                    <td class="text">{row.right_text}</td>
                </tr>
            ))}
        </tbody>
    );
}
