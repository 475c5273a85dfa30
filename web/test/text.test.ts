import assert from "node:assert/strict";
import { test } from "node:test";
import { matches, readNumber, score } from "../src/logic/text";

test("numbers are decimal, $hexadecimal or %binary, as in TMCL", () => {
    assert.deepEqual(
        ["12", "-12", "+3", "$ff", "-$10", "%101", "1.5", "\u22127", "1\u2009000"].map(text => readNumber(text)),
        [12, -12, 3, 255, -16, 5, 1.5, -7, 1000],
    );
    assert.deepEqual(
        ["", "x", "1x", "$", "%2", "--1", "0x10", "."].map(text => readNumber(text)),
        Array(8).fill(null),
    );
});

test("numbers take a decimal comma, groups of digits and units, and nothing that could be two numbers", () => {
    const read = (text: string) => readNumber(text, { mm: 320, "\u00b0": 64 / 0.9 });
    assert.deepEqual(
        ["1,5", "0,125", "12 345", "1'234'567", "1.234.567", "1,000,000", "-8\u2009388\u2009608"].map(read),
        [1.5, 0.125, 12345, 1234567, 1234567, 1000000, -8388608],
    );
    assert.deepEqual(["10 mm", "2,5mm", "-90\u00b0"].map(read), [3200, 800, -6400]);
    assert.deepEqual(["10,000", "1 2", "12 34", "1,2,3", "5 km", "1.2.3"].map(read), Array(6).fill(null));
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
