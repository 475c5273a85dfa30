// The frame is made by the Python side: tests/ide/test_front_end.py passes it in the environment.
import assert from "node:assert/strict";
import { test } from "node:test";
import { GROUPS, readFrame } from "../src/wire";

test("a frame made by the server is read with every value in its place", () => {
    const { FRAME: hex, EXPECTED: expected } = process.env;
    assert.ok(hex && expected, "run by pytest");
    const data = new Uint8Array(hex.match(/../g)!.map(byte => parseInt(byte, 16)));
    const found: Record<string, unknown> = {};
    readFrame(
        data.buffer,
        (index, group) => (found[GROUPS[index]!.name] = group),
        values => (found.watched = values),
    );
    assert.deepEqual(found, JSON.parse(expected));
});
