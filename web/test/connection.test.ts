import assert from "node:assert/strict";
import { test } from "node:test";
import { Connection, FaultError, RefusedError } from "../src/logic/connection";
import type { ServerEvent } from "../src/wire";

/** What the browser offers; the test plays the server. */
class Socket {
    static readonly OPEN = 1;
    static last: Socket;
    readonly readyState = Socket.OPEN;
    onmessage: (message: { data: string }) => void = () => {};
    sent: string[] = [];
    constructor() {
        Socket.last = this;
    }
    send(text: string): void {
        this.sent.push(text);
    }
    say(event: object): void {
        this.onmessage({ data: JSON.stringify(event) });
    }
}
Object.assign(globalThis, { WebSocket: Socket, location: { href: "http://127.0.0.1/" } });

test("an answer, a refusal and a bug of the server are three things", async () => {
    const connection = new Connection("/wire");
    const events: ServerEvent[] = [];
    connection.onEvent = event => events.push(event);
    connection.open();
    const calls = [1, 2, 3].map(() => connection.call({ call: "ping" }));
    assert.deepEqual(Socket.last.sent[2], '[3,{"call":"ping"}]');
    Socket.last.say({ event: "answer", id: 1, result: null });
    Socket.last.say({ event: "refusal", id: 2, code: "busy", text: "Too many." });
    Socket.last.say({ event: "fault", id: 3, text: "An error in the IDE itself" });
    assert.equal(await calls[0], null);
    await assert.rejects(calls[1]!, error => error instanceof RefusedError && error.code === "busy");
    await assert.rejects(calls[2]!, error => error instanceof FaultError && !(error instanceof RefusedError));
    assert.deepEqual(
        events.map(event => event.event),
        ["fault"],
    );
});
