// The arrows of an axis.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ask, connection } from "../../logic/app";
import { notReady, ready } from "../../logic/authority";
import { useFrameEffect } from "../../widgets/frame";
import { Icon } from "../../widgets/icons";
import { jogSpeed, microsteps, strides } from "./strides";
import { unless } from "../../logic/hindrance";

/** The server stops a motor whose button was not reported as held for a second. */
const AGAIN_MS = 250;

/** Turns while it is held, with pointer or key; anything that ends the hold or the sight of it stops the motor. */
export function Jog({ motor, direction }: { motor: number; direction: -1 | 1 }) {
    const held = useSignal(false);
    const timer = useRef(0);
    const say = (velocity: number) => connection.call({ call: "jog", motor, velocity }).catch(() => {});
    const start = () => {
        const speed = jogSpeed.value[motor];
        if (held.value || !ready.value || speed == null) return;
        const stride = strides.value[motor]!;
        if (stride !== "hold")
            return void ask({ call: "stride", motor, distance: direction * microsteps(motor, stride) });
        held.value = true;
        const velocity = direction * speed;
        void ask({ call: "jog", motor, velocity });
        timer.current = window.setInterval(() => void say(velocity), AGAIN_MS);
    };
    const end = () => {
        if (!held.peek()) return;
        held.value = false;
        clearInterval(timer.current);
        void say(0);
    };
    useEffect(() => {
        const ends = [
            [window, "blur"],
            [window, "pagehide"],
            [document, "visibilitychange"],
        ] as const;
        for (const [where, what] of ends) where.addEventListener(what, end);
        return () => {
            for (const [where, what] of ends) where.removeEventListener(what, end);
            end();
        };
    }, []);
    useFrameEffect(() => {
        if (!ready.value) end();
    });
    const hold = (event: KeyboardEvent) => {
        if (event.key !== " " && event.key !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) start();
    };
    const name = direction > 0 ? "right" : "left";
    return (
        <button
            class={`jog ${held.value ? "held" : ""}`}
            {...unless(
                notReady.value || (jogSpeed.value[motor] == null && "Type a speed first"),
                strides.value[motor] === "hold"
                    ? `Hold to turn ${name} at speed ${jogSpeed.value[motor]}`
                    : `Move ${name} by ${strides.value[motor]}`,
            )}
            aria-label={`Jog motor ${motor} ${name}`}
            onPointerDown={event => {
                if (event.button !== 0) return;
                event.currentTarget.setPointerCapture(event.pointerId);
                start();
            }}
            onPointerUp={end}
            onPointerCancel={end}
            onLostPointerCapture={end}
            onBlur={end}
            onContextMenu={event => event.preventDefault()}
            onKeyDown={hold}
            onKeyUp={end}
        >
            <Icon name={direction > 0 ? "jogRight" : "jogLeft"} />
        </button>
    );
}
