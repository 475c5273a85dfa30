// Marks beside the source that come from the module: coverage in the gutter, values at the ends of lines.
import { RangeSet, StateEffect, StateField, type Extension, type Range } from "@codemirror/state";
import { Decoration, EditorView, GutterMarker, WidgetType, gutter, type DecorationSet } from "@codemirror/view";
import { covered, coverageText } from "../logic/coverage";
import type { CoveredLine } from "../wire";

export const putCoverage = StateEffect.define<ReadonlyMap<number, CoveredLine> | null>();
export const putValues = StateEffect.define<ReadonlyMap<number, string>>();

class CoverageMarker extends GutterMarker {
    constructor(
        readonly kind: string,
        readonly text: string,
    ) {
        super();
    }
    override eq(other: CoverageMarker): boolean {
        return this.text === other.text;
    }
    override toDOM(): HTMLElement {
        const mark = document.createElement("span");
        mark.className = `coverage-mark ${this.kind}`;
        mark.title = this.text;
        return mark;
    }
}

/** Markers move with the text: counts are of the lines as they were. */
const coverageField = StateField.define<RangeSet<CoverageMarker>>({
    create: () => RangeSet.empty,
    update(set, transaction) {
        set = set.map(transaction.changes);
        for (const effect of transaction.effects) {
            if (!effect.is(putCoverage)) continue;
            const { doc } = transaction.state;
            const marks = [...(effect.value ?? [])]
                .filter(([line]) => line >= 1 && line <= doc.lines)
                .sort(([a], [b]) => a - b)
                .map(([line, row]) => new CoverageMarker(covered(row), coverageText(row)).range(doc.line(line).from));
            set = RangeSet.of(marks);
        }
        return set;
    },
});

class LiveValue extends WidgetType {
    constructor(readonly text: string) {
        super();
    }
    override eq(other: LiveValue): boolean {
        return this.text === other.text;
    }
    override toDOM(): HTMLElement {
        const value = document.createElement("span");
        value.className = "live-value";
        value.textContent = this.text;
        return value;
    }
}

const valuesField = StateField.define<DecorationSet>({
    create: () => Decoration.none,
    update(set, transaction) {
        set = set.map(transaction.changes);
        for (const effect of transaction.effects) {
            if (!effect.is(putValues)) continue;
            const { doc } = transaction.state;
            const marks: Range<Decoration>[] = [...effect.value]
                .filter(([line]) => line >= 1 && line <= doc.lines)
                .sort(([a], [b]) => a - b)
                .map(([line, text]) =>
                    Decoration.widget({ widget: new LiveValue(text), side: 2 }).range(doc.line(line).to),
                );
            set = Decoration.set(marks);
        }
        return set;
    },
    provide: field => EditorView.decorations.from(field),
});

/** `seen` gets the first and last line that a person sees. */
export function marks(seen: (first: number, last: number) => void): Extension {
    const tell = (view: EditorView) => {
        const { doc } = view.state;
        seen(doc.lineAt(view.viewport.from).number, doc.lineAt(view.viewport.to).number);
    };
    return [
        coverageField,
        valuesField,
        gutter({ class: "coverage", markers: view => view.state.field(coverageField) }),
        EditorView.updateListener.of(update => (update.viewportChanged || update.docChanged) && tell(update.view)),
    ];
}
