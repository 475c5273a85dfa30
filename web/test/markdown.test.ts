import assert from "node:assert/strict";
import { test } from "node:test";
import { toHtml } from "../src/editor/markdown";

test("a parameter's text becomes paragraphs and a list", () => {
    assert.equal(
        toHtml("**ramp mode** (axis parameter 138)\n\n0 to 2, default 0\n- 0: position\n- 2: `velocity`\n\nManual 7.1"),
        "<p><b>ramp mode</b> (axis parameter 138)</p><p>0 to 2, default 0</p>" +
            "<ul><li>0: position</li><li>2: <code>velocity</code></li></ul><p>Manual 7.1</p>",
    );
});

test("a fence keeps what it holds, and stars in code are stars", () => {
    assert.equal(
        toHtml("```tmcl\nMVP ABS, 0, 1\n```\n\n`a**b**`"),
        "<pre><code>MVP ABS, 0, 1\n</code></pre><p><code>a**b**</code></p>",
    );
});

test("HTML in a comment stays text", () => {
    assert.equal(
        toHtml('<img src=x onerror="alert(1)"> & **<b>**'),
        "<p>&lt;img src=x onerror=&quot;alert(1)&quot;&gt; &amp; <b>&lt;b&gt;</b></p>",
    );
});
