// Fields for numbers and choices. What is shown in a field is what is sent, or nothing is.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { readNumber, type Units } from "../logic/text";
import { Icon } from "./icons";
import { type Hindrance, unless } from "../logic/hindrance";

interface Limits {
    low?: number;
    high?: number;
    whole?: boolean;
    /** Words that may follow a number, and how much one of each is. */
    units?: Units;
}

const grouped = (value: number): string =>
    String(value)
        .replace("-", "\u2212")
        .replace(/\B(?=(\d{3})+(?!\d))/g, "\u2009");
const rangeText = ({ low, high, units = {} }: Limits): string => {
    const words = Object.keys(units);
    const range = low === undefined || high === undefined ? "" : ` from ${grouped(low)} to ${grouped(high)}`;
    return `A number${range}${words.length ? `, or so many ${words.join(", ")}` : ""}, please`;
};
const UNSENT = "Not sent yet: Enter sends, Esc drops";

/** The number that a text is, within its limits; null for none. */
export function readWithin(text: string, limits: Limits): number | null {
    const value = readNumber(text, limits.units);
    if (value === null || (limits.whole !== false && !Number.isInteger(value))) return null;
    return value >= (limits.low ?? -Infinity) && value <= (limits.high ?? Infinity) ? value : null;
}

/** Show another value; a text that is selected as a whole stays so: what is typed next replaces it, whenever the value moves. */
function showText(field: HTMLInputElement, text: string): void {
    if (field.value === text) return;
    const whole = field.value !== "" && field.selectionStart === 0 && field.selectionEnd === field.value.length;
    field.value = text;
    if (whole && document.activeElement === field) field.select();
}

interface Common extends Limits {
    label: string;
    width?: number;
    /** What keeps it from being used. */
    hindrance?: Hindrance;
    class?: string;
}

/** A number for the page alone: it counts as it is typed, null while it is none. */
export function LocalNumber(
    props: Common & { value: number | string | null; onInput: (value: number | null) => void },
) {
    const field = useRef<HTMLInputElement>(null);
    const wrong = useSignal(props.value === null);
    const show = () => {
        if (!wrong.peek() && props.value !== null) field.current!.value = String(props.value);
    };
    useEffect(() => {
        if (document.activeElement !== field.current) show();
    }, [props.value]);
    return (
        <input
            ref={field}
            class={`number ${wrong.value ? "wrong" : ""} ${props.class ?? ""}`}
            aria-label={props.label}
            aria-invalid={wrong.value}
            {...unless(props.hindrance, wrong.value ? rangeText(props) : undefined)}
            autocomplete="off"
            spellcheck={false}
            style={props.width ? { width: `${props.width}px` } : undefined}
            onBlur={show}
            onInput={event => {
                const value = readWithin(event.currentTarget.value, props);
                wrong.value = value === null;
                props.onInput(value);
            }}
            onKeyDown={event => event.key === "Enter" && event.currentTarget.select()}
        />
    );
}

/** The button beside a draft; it takes no focus, so that the field keeps its caret. */
const Send = ({ label, disabled, onClick }: { label: string; disabled?: boolean; onClick: () => void }) => (
    <button
        type="button"
        class="send"
        aria-label={`Send ${label}`}
        title="Not sent yet: Enter or this button sends, Esc drops"
        disabled={disabled}
        onPointerDown={event => event.preventDefault()}
        onClick={onClick}
    >
        <Icon name="check" size={11} />
    </button>
);

/** How long what was sent is shown before the field says again what is known, where nothing tells when it was done. */
const SETTLE_MS = 2000;

/** A number in the module: a draft until Enter or its button sends it; Escape drops it. Leaving the field writes nothing.
 * `onCommit` may return a promise of the answer: after a refusal the field shows the module's value again. */
export function NumberField(props: Common & { value: number | string; onCommit: (value: number) => unknown }) {
    const field = useRef<HTMLInputElement>(null);
    const known = useRef(props.value);
    known.current = props.value;
    const draft = useSignal<string | null>(null);
    const value = draft.value === null ? null : readWithin(draft.value, props);
    const wrong = draft.value !== null && value === null;
    const drop = () => {
        draft.value = null;
        field.current!.value = String(props.value);
    };
    useEffect(() => {
        if (draft.peek() === null) showText(field.current!, String(props.value));
    }, [props.value]);
    const send = () => {
        const typed = draft.peek() === null ? null : readWithin(draft.peek()!, props);
        if (typed === null) return;
        const answer = props.onCommit(typed);
        draft.value = null;
        field.current!.value = String(typed);
        const settle = () => {
            if (draft.peek() === null && field.current) showText(field.current, String(known.current));
        };
        if (answer instanceof Promise) void answer.finally(settle);
        else setTimeout(settle, SETTLE_MS);
    };
    const state = draft.value === null ? "" : wrong ? "wrong unsent" : "unsent";
    return (
        <span class={`draft ${props.class ?? ""}`} style={props.width ? { width: `${props.width}px` } : undefined}>
            <input
                ref={field}
                class={`number ${state}`}
                inputMode={(props.low ?? -1) < 0 ? "text" : "numeric"}
                enterKeyHint="send"
                autocomplete="off"
                spellcheck={false}
                aria-label={props.label}
                aria-invalid={wrong}
                {...unless(
                    props.hindrance,
                    wrong
                        ? rangeText(props)
                        : draft.value === null
                          ? undefined
                          : `${UNSENT}${draft.value === String(value) ? "" : `; it is ${grouped(value!)}`}`,
                )}
                onInput={event =>
                    (draft.value = event.currentTarget.value === String(props.value) ? null : event.currentTarget.value)
                }
                onKeyDown={event => {
                    if (event.key === "Enter") {
                        event.preventDefault();
                        send();
                        field.current!.select();
                    } else if (event.key === "Escape") drop();
                }}
            />
            {draft.value !== null && <Send label={props.label} disabled={wrong || !!props.hindrance} onClick={send} />}
        </span>
    );
}

/** A choice in the module: a draft as `NumberField` is, whatever key or wheel changes it; null is not known. */
export function SelectField(props: {
    value: number | null;
    choices: readonly { value: number; text: string }[];
    label: string;
    hindrance?: Hindrance;
    numbers?: boolean;
    onCommit: (value: number) => void;
}) {
    const draft = useSignal<number | null>(null);
    const shown = draft.value ?? props.value;
    const send = () => {
        if (draft.value === null) return;
        props.onCommit(draft.value);
        draft.value = null;
    };
    const known = props.choices.some(choice => choice.value === shown);
    return (
        <span class="draft">
            <select
                class={draft.value === null ? "" : "unsent"}
                aria-label={props.label}
                value={String(shown)}
                {...unless(
                    props.hindrance,
                    draft.value === null ? props.choices.find(choice => choice.value === shown)?.text : UNSENT,
                )}
                onChange={event => {
                    const next = Number(event.currentTarget.value);
                    draft.value = next === props.value ? null : next;
                }}
                onKeyDown={event => {
                    if (event.key === "Enter" && draft.value !== null) {
                        event.preventDefault();
                        send();
                    } else if (event.key === "Escape") draft.value = null;
                }}
            >
                {!known && <option value={String(shown)}>{shown ?? "\u2013"}</option>}
                {props.choices.map(choice => (
                    <option key={choice.value} value={String(choice.value)} selected={choice.value === shown}>
                        {props.numbers === false ? "" : `${choice.value} `}
                        {choice.text}
                    </option>
                ))}
            </select>
            {draft.value !== null && <Send label={props.label} disabled={!!props.hindrance} onClick={send} />}
        </span>
    );
}
