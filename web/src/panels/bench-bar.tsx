// Above a bench file in the editor: whether it can be used, and the button that builds the virtual module with it.
import { benches } from "../editor/bench";
import { activeDocument, problems } from "../logic/documents";
import { useVirtual } from "../logic/modules";
import { connecting, offline, unless } from "../logic/hindrance";

export function BenchBar() {
    const document = activeDocument.value;
    if (!document || !benches.value.has(document.path)) return null;
    const mistakes = problems.value.get(document.path) ?? [];
    const wrong = mistakes[0];
    const { path } = document;
    return (
        <div class="bench-bar" role="region" aria-label="Bench file">
            <b>Bench</b>
            <span class={wrong ? "bad" : "muted"}>
                {mistakes.length > 1 && `${mistakes.length} mistakes; `}
                {wrong ? `line ${wrong.place.line}: ${wrong.text}` : "no mistakes"}
            </span>
            <span class="gap" />
            <button
                class="primary"
                {...unless(
                    offline.value || connecting.value || (wrong && "The bench has errors"),
                    "Build the virtual module anew with this machine, as on the screen; program and stored settings are kept",
                )}
                onClick={() => useVirtual({ bench: path, text: document.text.value })}
            >
                Use this bench
            </button>
        </div>
    );
}
