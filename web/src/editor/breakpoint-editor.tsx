// Breakpoints of the editor: set and removed in the margin, their conditions in a small form.
import { signal } from "@preact/signals";
import { breakpoints, setBreakpoints, type Breakpoint } from "../logic/debugger";

/** The breakpoint whose conditions are being edited, and where on the screen. */
export const editedBreakpoint = signal<{ path: string; line: number; x: number; y: number } | null>(null);

export function toggleBreakpoint(path: string, line: number): void {
    const others = breakpoints.value.filter(point => point.path !== path || point.line !== line);
    const added: Breakpoint[] =
        others.length < breakpoints.value.length ? [] : [{ path, line, condition: "", hits: "", log: "" }];
    void setBreakpoints([...others, ...added]);
}

export function BreakpointEditor() {
    const place = editedBreakpoint.value;
    if (!place) return null;
    const found = breakpoints.value.find(point => point.path === place.path && point.line === place.line);
    const start: Breakpoint = found ?? { path: place.path, line: place.line, condition: "", hits: "", log: "" };
    const others = breakpoints.value.filter(point => point !== found);
    const close = () => (editedBreakpoint.value = null);
    const submit = (event: Event) => {
        event.preventDefault();
        const data = new FormData(event.currentTarget as HTMLFormElement);
        const text = (name: string) => String(data.get(name) ?? "").trim();
        void setBreakpoints([
            ...others,
            { ...start, condition: text("condition"), hits: text("hits"), log: text("log") },
        ]);
        close();
    };
    return (
        <form
            class="popover breakpoint-editor"
            style={{ left: `${place.x}px`, top: `${place.y}px` }}
            onSubmit={submit}
            onKeyDown={event => event.key === "Escape" && close()}
        >
            <h3>Breakpoint at line {place.line}</h3>
            <label>
                Hold when
                <input name="condition" defaultValue={start.condition} placeholder="accumulator &gt; 100" autofocus />
            </label>
            <label>
                at hits
                <input name="hits" defaultValue={start.hits} placeholder="5, == 3, % 10" />
            </label>
            <label>
                or only log
                <input name="log" defaultValue={start.log} placeholder="round {gp[0]}" />
            </label>
            <div class="row">
                <button type="submit" class="primary">
                    Set
                </button>
                <button
                    type="button"
                    onClick={() => {
                        void setBreakpoints(others);
                        close();
                    }}
                >
                    Remove
                </button>
                <button type="button" onClick={close}>
                    Cancel
                </button>
            </div>
        </form>
    );
}
