// A hover that is answered when the pointer has left the editor would stay open: the library forgets to give it up.
import type { Extension } from "@codemirror/state";
import { closeHoverTooltips, EditorView, hasHoverTooltips } from "@codemirror/view";

/** Closes hovers that open while the pointer is elsewhere. */
export function hoversEnd(): Extension {
    let away = false;
    return [
        EditorView.domEventObservers({
            mouseleave: () => void (away = true),
            mousemove: () => void (away = false),
        }),
        EditorView.updateListener.of(update => {
            if (!away || hasHoverTooltips(update.startState) || !hasHoverTooltips(update.state)) return;
            queueMicrotask(() => update.view.dispatch({ effects: closeHoverTooltips }));
        }),
    ];
}
