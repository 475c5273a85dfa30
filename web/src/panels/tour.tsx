// The card of the guided tour, beside what it is about, and the offer to take it.
import { useLayoutEffect, useRef } from "preact/hooks";
import { STOPS, beginTour, endTour, goOn, tourAt, tourSeen } from "../logic/tour";
import { IconButton } from "../widgets/basics";

const MARGIN = 12;

export function Tour() {
    const card = useRef<HTMLDialogElement>(null);
    const ring = useRef<HTMLDivElement>(null);
    const at = tourAt.value;
    useLayoutEffect(() => {
        if (at === null) return;
        const put = () => place(card.current!, ring.current!, STOPS[at]!.selector);
        put();
        card.current!.querySelector<HTMLElement>(".primary")!.focus();
        window.addEventListener("resize", put);
        window.addEventListener("scroll", put, true);
        return () => {
            window.removeEventListener("resize", put);
            window.removeEventListener("scroll", put, true);
        };
    }, [at]);
    if (at === null) return null;
    const { title, text } = STOPS[at]!;
    const last = at === STOPS.length - 1;
    return (
        <>
            <div class="tour-ring" ref={ring} />
            <dialog
                class="tour"
                open
                ref={card}
                aria-label={`Tour: ${title}`}
                onKeyDown={event => event.key === "Escape" && endTour()}
            >
                <h3>{title}</h3>
                <p>{text}</p>
                <div class="row">
                    <span class="muted">
                        {at + 1} of {STOPS.length}
                    </span>
                    <span class="gap" />
                    {last || <button onClick={endTour}>Skip</button>}
                    {at > 0 && <button onClick={() => goOn(-1)}>Back</button>}
                    <button class="primary" onClick={() => goOn(1)}>
                        {last ? "Done" : "Next"}
                    </button>
                </div>
            </dialog>
        </>
    );
}

/** The shade leaves the tool bar with STOP ALL in full colour, unless the place is there. */
function clear(top: number): string {
    const bar = document.querySelector(".top")?.getBoundingClientRect().bottom ?? 0;
    return top < bar ? "none" : `inset(${bar - top}px -200vmax -200vmax)`;
}

/** The card goes below its place, or where there is room. */
function place(card: HTMLElement, ring: HTMLElement, selector: string): void {
    const box = document.querySelector(selector)?.getBoundingClientRect();
    if (!box) return;
    const top = Math.max(0, box.top);
    const bottom = Math.min(window.innerHeight, box.bottom);
    Object.assign(ring.style, {
        left: `${box.left}px`,
        top: `${top}px`,
        width: `${box.width}px`,
        height: `${bottom - top}px`,
        clipPath: clear(top),
    });
    const { width, height } = card.getBoundingClientRect();
    const below = bottom + MARGIN + height < window.innerHeight;
    const above = top - MARGIN - height > 0;
    const y = below ? bottom + MARGIN : above ? top - MARGIN - height : Math.max(MARGIN, (top + bottom - height) / 2);
    const x = Math.min(Math.max(MARGIN, box.left + (box.width - width) / 2), window.innerWidth - width - MARGIN);
    Object.assign(card.style, { left: `${x}px`, top: `${y}px` });
}

/** In the status bar, until the tour was taken or refused. */
export function TourOffer() {
    if (tourSeen.value || tourAt.value !== null) return null;
    return (
        <span class="tour-offer">
            New here?{" "}
            <button class="link" onClick={beginTour}>
                Take the tour
            </button>
            <IconButton icon="close" size={11} label="No tour" title="Do not offer it again" onClick={endTour} />
        </span>
    );
}
