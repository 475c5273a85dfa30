import assert from "node:assert/strict";
import { test } from "node:test";
import { matches, readNumber, score } from "../src/logic/text";

test("numbers are decimal, $hexadecimal or %binary, as in TMCL", () => {
    assert.deepEqual(["12", "-12", "+3", "$ff", "-$10", "%101", "1.5", "\u22127", "1\u2009000"].map(readNumber), [12, -12, 3, 255, -16, 5, 1.5, -7, 1000]);
    assert.deepEqual(["", "x", "1x", "$", "%2", "--1", "0x10", "."].map(readNumber), Array(8).fill(null));
});

test("a filter wants all its words and none with a minus", () => {
    assert.ok(matches("IDE in 01 02 ROR 0, 500", ["ror", "500"]));
    assert.ok(!matches("IDE in 01 02 ROR 0, 500", ["ror", "-ide"]));
    assert.ok(matches("value -5", ["-"]));
});

test("a beginning counts more than a middle, and letters in order still count", () => {
    assert.ok(score("Stop motor 0", "stop") > score("STOP ALL and stop", "and"));
    assert.ok(score("Upload and disassemble", "upl") > score("Show Plot", "pl") - 100);
    assert.ok(score("Hold or release time", "hrt") > 0);
    assert.equal(score("Run", "xyz"), 0);
});
