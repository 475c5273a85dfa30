// Breakpoints, addresses and the line that the module executes.
import { RangeSet, StateEffect, StateField, type EditorState, type Extension } from "@codemirror/state";
import { Decoration, EditorView, GutterMarker, gutter, type DecorationSet } from "@codemirror/view";

export interface LineBreakpoint {
    line: number;
    condition: string;
    hits: string;
    log: string;
    /** Set when the server has found an instruction for it. */
    verified: boolean;
    reason: string;
    /** How often it was met; undefined while that is not known. */
    met?: number;
}

export const putBreakpoints = StateEffect.define<LineBreakpoint[]>();
export const putAddresses = StateEffect.define<ReadonlyMap<number, number>>();
export const putExecution = StateEffect.define<{ line: number; held: boolean } | null>();

class BreakpointMarker extends GutterMarker {
    constructor(readonly breakpoint: LineBreakpoint) {
        super();
    }
    override eq(other: BreakpointMarker): boolean {
        const [a, b] = [this.breakpoint, other.breakpoint];
        const same = a.condition === b.condition && a.hits === b.hits && a.log === b.log;
        return same && a.verified === b.verified && a.met === b.met;
    }
    override toDOM(): HTMLElement {
        const dot = document.createElement("span");
        const { condition, hits, log, verified, reason, met } = this.breakpoint;
        dot.className = `breakpoint${verified ? "" : " unverified"}${log ? " logpoint" : ""}${condition || hits ? " conditional" : ""}`;
        dot.title = [
            log ? `log: ${log}` : "breakpoint",
            condition && `when ${condition}`,
            hits && `hits ${hits}`,
            verified && reason,
            met !== undefined && `met ${met === 1 ? "once" : `${met} times`}`,
            !verified && (reason || "not in the downloaded program"),
        ]
            .filter(Boolean)
            .join(", ");
        if (!met) return dot;
        const both = document.createElement("span");
        both.className = "met";
        both.append(dot, String(met > 99 ? "99+" : met));
        return both;
    }
}

/** Markers that move with the text. */
export const breakpointField = StateField.define<RangeSet<BreakpointMarker>>({
    create: () => RangeSet.empty,
    update(set, transaction) {
        set = set.map(transaction.changes);
        for (const effect of transaction.effects) {
            if (!effect.is(putBreakpoints)) continue;
            const { doc } = transaction.state;
            const marks = effect.value
                .filter(mark => mark.line >= 1 && mark.line <= doc.lines)
                .sort((a, b) => a.line - b.line)
                .map(mark => new BreakpointMarker(mark).range(doc.line(mark.line).from));
            set = RangeSet.of(marks);
        }
        return set;
    },
});

/** Breakpoints with the lines where they are now. */
export function breakpointsOf(state: EditorState): LineBreakpoint[] {
    const found = new Map<number, LineBreakpoint>();
    for (const cursor = state.field(breakpointField).iter(); cursor.value; cursor.next()) {
        const line = state.doc.lineAt(cursor.from).number;
        found.set(line, { ...cursor.value.breakpoint, line });
    }
    return [...found.values()];
}

const addressField = StateField.define<ReadonlyMap<number, number>>({
    create: () => new Map(),
    update(map, transaction) {
        for (const effect of transaction.effects) if (effect.is(putAddresses)) map = effect.value;
        return map;
    },
});

class AddressMarker extends GutterMarker {
    constructor(readonly address: number) {
        super();
    }
    override eq(other: AddressMarker): boolean {
        return this.address === other.address;
    }
    override toDOM(): Node {
        return document.createTextNode(String(this.address));
    }
}

const executionField = StateField.define<{ line: number; held: boolean; marks: DecorationSet } | null>({
    create: () => null,
    update(place, transaction) {
        for (const effect of transaction.effects) {
            if (!effect.is(putExecution)) continue;
            const { doc } = transaction.state;
            const wish = effect.value;
            if (!wish || wish.line < 1 || wish.line > doc.lines) return null;
            const kind = wish.held ? "execution held" : "execution";
            const marks = Decoration.set(Decoration.line({ class: kind }).range(doc.line(wish.line).from));
            return { ...wish, marks };
        }
        return place && transaction.docChanged ? { ...place, marks: place.marks.map(transaction.changes) } : place;
    },
    provide: field => EditorView.decorations.from(field, place => place?.marks ?? Decoration.none),
});

export function gutters(toggle: (line: number) => void, edit: (line: number, at: HTMLElement) => void): Extension {
    return [
        breakpointField,
        addressField,
        executionField,
        gutter({
            class: "breakpoints",
            renderEmptyElements: true,
            markers: view => view.state.field(breakpointField),
            domEventHandlers: {
                mousedown(view, block, event) {
                    const line = view.state.doc.lineAt(block.from).number;
                    if ((event as MouseEvent).button === 0) toggle(line);
                    return true;
                },
                contextmenu(view, block, event) {
                    edit(view.state.doc.lineAt(block.from).number, event.target as HTMLElement);
                    event.preventDefault();
                    return true;
                },
            },
            initialSpacer: () =>
                new BreakpointMarker({
                    line: 1,
                    condition: "",
                    hits: "",
                    log: "",
                    verified: true,
                    reason: "",
                }),
        }),
        gutter({
            class: "addresses",
            lineMarker(view, block) {
                const address = view.state.field(addressField).get(view.state.doc.lineAt(block.from).number);
                return address === undefined ? null : new AddressMarker(address);
            },
            lineMarkerChange: update =>
                update.startState.field(addressField) !== update.state.field(addressField) || update.docChanged,
            initialSpacer: () => new AddressMarker(888),
        }),
    ];
}
