// The web socket to the server: numbered calls, events, state frames, and coming back after a loss.
import { signal } from "@preact/signals";
import type { Call, Results, ServerEvent } from "../wire";

export type LinkState = "connecting" | "open" | "lost" | "refused";

/** A call that the server did not do; `code` is for the page, the message for people. */
export class RefusedError extends Error {
    constructor(
        readonly code: string,
        message: string,
    ) {
        super(message);
    }
}

/** A call that met a bug of the server; shown by whoever takes events. */
export class FaultError extends Error {}

interface Waiting {
    resolve: (result: never) => void;
    reject: (error: Error) => void;
}

const RETRY_MS = [200, 400, 800, 1500, 2500];

export class Connection {
    readonly state = signal<LinkState>("connecting");
    onEvent: (event: ServerEvent) => void = () => {};
    onFrame: (data: ArrayBuffer) => void = () => {};
    private socket: WebSocket | null = null;
    private waiting = new Map<number, Waiting>();
    private next = 1;
    private failures = 0;

    constructor(private readonly path: string) {}

    open(): void {
        const socket = new WebSocket(new URL(this.path, location.href.replace(/^http/, "ws")));
        socket.binaryType = "arraybuffer";
        this.socket = socket;
        socket.onopen = () => {
            this.failures = 0;
            this.state.value = "open";
        };
        socket.onmessage = ({ data }) => {
            if (typeof data === "string") this.take(JSON.parse(data) as ServerEvent);
            else this.onFrame(data as ArrayBuffer);
        };
        socket.onclose = () => void this.closed();
    }

    /** Ask the server for something; rejects with `RefusedError`, and with `FaultError` where the server has a bug. */
    call<C extends Call>(call: C): Promise<Results[C["call"]]> {
        const socket = this.socket;
        if (!socket || socket.readyState !== WebSocket.OPEN)
            return Promise.reject(new RefusedError("offline", "The IDE's server is not connected."));
        const id = this.next++;
        socket.send(JSON.stringify([id, call]));
        return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
    }

    private take(event: ServerEvent): void {
        if (event.event === "answer") this.settle(event.id)?.resolve(event.result as never);
        else if (event.event === "refusal") this.settle(event.id)?.reject(new RefusedError(event.code, event.text));
        else {
            if (event.event === "fault") this.settle(event.id)?.reject(new FaultError(event.text));
            this.onEvent(event);
        }
    }

    private settle(id: number): Waiting | undefined {
        const waiting = this.waiting.get(id);
        this.waiting.delete(id);
        return waiting;
    }

    private async closed(): Promise<void> {
        this.socket = null;
        for (const waiting of this.waiting.values())
            waiting.reject(new RefusedError("offline", "The connection to the IDE's server was lost."));
        this.waiting.clear();
        this.state.value = (await this.turnedAway()) ? "refused" : "lost";
        const pause = RETRY_MS[Math.min(this.failures++, RETRY_MS.length - 1)]!;
        setTimeout(() => this.open(), this.state.value === "refused" ? 5000 : pause);
    }

    /** Whether a server is there that does not know this window: it was started anew. */
    private async turnedAway(): Promise<boolean> {
        try {
            return (await fetch("/alive", { cache: "no-store" })).status === 403;
        } catch {
            return false;
        }
    }
}
