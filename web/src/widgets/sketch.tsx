// A canvas drawn by hand whenever the values that its drawing reads change: nothing is styled, laid out or put into
// layers anew for it.
import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { shownTheme } from "../logic/theme";
import { useFrameEffect } from "./frame";

/** What a drawing draws with: lengths are CSS pixels, colours have the names of the style sheets. */
export interface Pen {
    ctx: CanvasRenderingContext2D;
    width: number;
    height: number;
    colour: (name: string) => string;
}

/** A pen for a canvas as large as it is shown. A computed style costs more than a drawing: it is asked once a colour. */
function penFor(canvas: HTMLCanvasElement): Pen {
    const { clientWidth: width, clientHeight: height } = canvas;
    canvas.width = Math.round(width * devicePixelRatio);
    canvas.height = Math.round(height * devicePixelRatio);
    const style = getComputedStyle(canvas);
    const colours = new Map<string, string>();
    const colour = (name: string): string => {
        const found = colours.get(name) ?? style.getPropertyValue(name).trim();
        colours.set(name, found);
        return found;
    };
    return { ctx: canvas.getContext("2d")!, width, height, colour };
}

export function Sketch({ draw }: { draw: (pen: Pen) => void }) {
    const canvas = useRef<HTMLCanvasElement>(null);
    const pen = useSignal<Pen | null>(null);
    const theme = shownTheme();
    // The observer calls at once, with the styles of the theme in force; the page's zoom alone changes no size.
    useLayoutEffect(() => {
        const take = () => void (pen.value = penFor(canvas.current!));
        const observer = new ResizeObserver(take);
        observer.observe(canvas.current!);
        window.addEventListener("resize", take);
        return () => {
            observer.disconnect();
            window.removeEventListener("resize", take);
        };
    }, [theme]);
    useFrameEffect(() => {
        if (!pen.value) return;
        const { ctx, width, height } = pen.value;
        ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
        ctx.clearRect(0, 0, width, height);
        draw(pen.value);
    });
    return <canvas ref={canvas} aria-hidden="true" />;
}
