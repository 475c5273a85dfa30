// Small controls shared by the panels.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { action, perform } from "../logic/actions";
import { Icon } from "./icons";
import { type Hindrance, unless } from "../logic/hindrance";

/** A button for a row of ACTIONS. */
export function ActionButton({ id, label = false, tone = "" }: { id: string; label?: boolean; tone?: string }) {
    const row = action(id);
    const title = [row.hint ?? row.title, row.keys?.[0] && `(${row.keys[0]})`].filter(Boolean).join(" ");
    return (
        <button
            class={`tool ${tone} ${row.on?.() ? "on" : ""}`}
            aria-pressed={row.on?.()}
            {...unless(row.hindrance?.(), title)}
            aria-label={row.title}
            data-action={id}
            onClick={() => perform(id)}
        >
            {row.icon && <Icon name={row.icon} />}
            {label && <span>{row.title}</span>}
        </button>
    );
}

/** A button with an icon alone: `label` is its name, `title` says more. */
export function IconButton(props: {
    icon: string;
    label: string;
    onClick: () => void;
    title?: string;
    size?: number;
    class?: string;
    hindrance?: Hindrance;
    pressed?: boolean;
    expanded?: boolean;
}) {
    return (
        <button
            class={`tool ${props.class ?? ""} ${props.pressed ? "on" : ""}`}
            aria-label={props.label}
            aria-pressed={props.pressed}
            aria-expanded={props.expanded}
            {...unless(props.hindrance, props.title ?? props.label)}
            onClick={() => props.onClick()}
        >
            <Icon name={props.icon} size={props.size} />
        </button>
    );
}

export function Lamp({
    on,
    label,
    tone = "",
    unknown = false,
}: {
    on: boolean;
    label: string;
    tone?: string;
    unknown?: boolean;
}) {
    return (
        <span
            class={`lamp ${unknown ? "unknown" : on ? "on" : ""} ${tone}`}
            role="img"
            aria-label={`${label} ${unknown ? "unknown" : on ? "on" : "off"}`}
        />
    );
}

export function Switch(props: { on: boolean; onChange: (on: boolean) => void; label: string }) {
    return (
        <button
            class={`switch ${props.on ? "on" : ""}`}
            role="switch"
            aria-checked={props.on}
            aria-label={props.label}
            onClick={() => props.onChange(!props.on)}
        >
            <span />
        </button>
    );
}

/** A handle that changes a size while it is dragged. */
export function Splitter(props: { vertical: boolean; onDrag: (delta: number) => void; label: string; size: number }) {
    return (
        <div
            class={`splitter ${props.vertical ? "vertical" : "horizontal"}`}
            role="separator"
            tabIndex={0}
            aria-label={props.label}
            aria-orientation={props.vertical ? "vertical" : "horizontal"}
            aria-valuenow={props.size}
            aria-valuemin={0}
            aria-valuemax={2000}
            onKeyDown={event => {
                const step = { ArrowLeft: -16, ArrowUp: -16, ArrowRight: 16, ArrowDown: 16 }[event.key];
                if (!step) return;
                event.preventDefault();
                props.onDrag(step);
            }}
            onPointerDown={event => {
                const handle = event.currentTarget as HTMLElement;
                handle.setPointerCapture(event.pointerId);
                let last = props.vertical ? event.clientX : event.clientY;
                const move = (next: PointerEvent) => {
                    const at = props.vertical ? next.clientX : next.clientY;
                    props.onDrag(at - last);
                    last = at;
                };
                handle.addEventListener("pointermove", move);
                handle.addEventListener("lostpointercapture", () => handle.removeEventListener("pointermove", move), {
                    once: true,
                });
            }}
        />
    );
}

/** Arrow keys go from one tab, choice or entry to the next of the same list. */
export function walk(event: KeyboardEvent): void {
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    const list = event.currentTarget as HTMLElement;
    const items = [...list.querySelectorAll<HTMLElement>("[role=tab], [role=radio], [role=treeitem], [role=menuitem]")];
    const at = items.indexOf(document.activeElement as HTMLElement);
    if (!step || at < 0) return;
    event.preventDefault();
    const next = items[(at + step + items.length) % items.length]!;
    next.focus();
    if (next.role === "tab" || next.role === "radio") next.click();
}

/** Buttons of which one is down. */
export function Choice<T extends string | number>(props: {
    value: T;
    options: readonly (readonly [T, string])[];
    onChange: (value: T) => void;
    label: string;
}) {
    return (
        <div class="choice" role="radiogroup" aria-label={props.label} onKeyDown={walk}>
            {props.options.map(([value, text]) => (
                <button
                    key={value}
                    role="radio"
                    aria-checked={value === props.value}
                    tabIndex={value === props.value ? 0 : -1}
                    class={value === props.value ? "on" : ""}
                    onClick={() => props.onChange(value)}
                >
                    {text}
                </button>
            ))}
        </div>
    );
}

/** A list that a button opens; a choice, Escape or going elsewhere closes it. */
export function Menu(props: {
    icon: string;
    label: string;
    text?: string;
    class?: string;
    size?: number;
    tall?: boolean;
    children: ComponentChildren;
}) {
    const open = useSignal(false);
    const button = useRef<HTMLButtonElement>(null);
    const close = () => {
        open.value = false;
        button.current?.focus();
    };
    return (
        <div
            class="menu-holder"
            onFocusOut={event =>
                event.currentTarget.contains(event.relatedTarget as Node | null) || (open.value = false)
            }
            onKeyDown={event => event.key === "Escape" && open.value && close()}
        >
            <button
                ref={button}
                class={props.class ?? "tool"}
                title={props.label}
                aria-label={props.label}
                aria-haspopup="menu"
                aria-expanded={open.value}
                onClick={() => (open.value = !open.value)}
            >
                <Icon name={props.icon} size={props.size ?? (props.text ? 11 : 16)} />
                {props.text && ` ${props.text}`}
            </button>
            {open.value && (
                <div
                    class={`menu ${props.tall ? "tall" : ""}`}
                    role="menu"
                    tabIndex={-1}
                    onKeyDown={walk}
                    onClick={event => (event.target as Element).closest("[role=menuitem]") && close()}
                >
                    {props.children}
                </div>
            )}
        </div>
    );
}

/** A window over the page that keeps the keyboard until it is closed. */
export function Modal(props: { label: string; class: string; onClose: () => void; children: ComponentChildren }) {
    const dialog = useRef<HTMLDialogElement>(null);
    useLayoutEffect(() => {
        const shown = dialog.current!;
        shown.showModal();
        return () => shown.close();
    }, []);
    // The browser closes it at once and says so later: who opens it again meanwhile would have it closed.
    const leave = (event: KeyboardEvent) => {
        if (event.key !== "Escape") return;
        event.preventDefault();
        props.onClose();
    };
    return (
        <dialog
            ref={dialog}
            class={props.class}
            aria-label={props.label}
            // A dialog that is gone from the page says so later: another one may be open by then.
            onClose={event => event.currentTarget.isConnected && props.onClose()}
            onKeyDown={leave}
            onPointerDown={event => event.target === event.currentTarget && props.onClose()}
        >
            {props.children}
        </dialog>
    );
}

/** What a panel shows when there is nothing. */
export function Empty({ icon, title, children }: { icon: string; title: string; children?: ComponentChildren }) {
    return (
        <div class="empty">
            <Icon name={icon} size={28} />
            <h3>{title}</h3>
            <div>{children}</div>
        </div>
    );
}

/** Give the user a file. */
export function offer(name: string, content: Blob | string): void {
    const blob = typeof content === "string" ? new Blob([content], { type: "text/plain" }) : content;
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(blob);
    anchor.download = name;
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
}
