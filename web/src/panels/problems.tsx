// Diagnostics of all files, and what was said lately.
import { output } from "../logic/app";
import { openFile, problems } from "../logic/documents";
import { Empty } from "../widgets/basics";
import { Icon } from "../widgets/icons";

const ICONS = { error: "alert", warning: "alert", information: "info", hint: "info" } as const;
const ORDER = { error: 0, warning: 1, information: 2, hint: 3 } as const;

export function Problems() {
    const list = [...problems.value.values()]
        .flat()
        .sort(
            (a, b) =>
                ORDER[a.severity] - ORDER[b.severity] ||
                a.place.path.localeCompare(b.place.path) ||
                a.place.line - b.place.line,
        );
    return (
        <div class="problems">
            <div class="list" role="group" aria-label="Problems">
                {list.length ? (
                    list.map((problem, n) => (
                        <button
                            key={n}
                            class={`problem ${problem.severity}`}
                            onClick={() => openFile(problem.place.path, problem.place.line, problem.place.column)}
                        >
                            <Icon name={ICONS[problem.severity]} />
                            <span class="text">{problem.text}</span>
                            <span class="diagnostic-code">{problem.code}</span>
                            <span class="place">
                                {problem.place.path}:{problem.place.line}
                            </span>
                        </button>
                    ))
                ) : (
                    <Empty icon="check" title="No problems">
                        The assembler and the linter have nothing to say.
                    </Empty>
                )}
            </div>
            <div class="output" aria-label="Messages" role="log">
                <h4>Messages</h4>
                {!output.value.length && <p class="note">Messages of the IDE and of log points appear here.</p>}
                {output.value
                    .slice()
                    .reverse()
                    .map((entry, n) => (
                        <div key={n} class={entry.severity}>
                            <time>{entry.at.toLocaleTimeString("en-GB")}</time> {entry.text}
                        </div>
                    ))}
            </div>
        </div>
    );
}
