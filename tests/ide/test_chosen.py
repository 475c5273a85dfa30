"""Files that a person chooses: read in the encodings of the tool chain."""

from __future__ import annotations

import asyncio
import codecs

import pytest

from ide.ide_driver import running, virtual
from tmcm34x.ide import wire

SETTINGS = "// Gr\u00f6\u00dfe \u20ac\r\nSAP 4, 0, 777\r\n"
TRACEFILE = "TN:\nSF:Pr\u00fcfung.tmc\nDA:1,3\nend_of_record\n"
ENCODED = [
    lambda text: text.encode(),
    lambda text: codecs.BOM_UTF8 + text.encode(),
    lambda text: codecs.BOM_UTF16_LE + text.encode("utf-16-le"),
    lambda text: codecs.BOM_UTF16_BE + text.encode("utf-16-be"),
    lambda text: text.encode("cp1252"),
]


def _go(folder, scenario):
    async def run():
        async with running(folder, virtual()) as ide, ide.page() as page:
            await scenario(page)

    asyncio.run(run())


@pytest.mark.parametrize("encode", ENCODED)
def test_settings_and_tracefiles_are_read_in_each_encoding(tmp_path, encode):
    async def scenario(page):
        imported = await page.call(wire.ImportSettings(encode(SETTINGS)))
        assert imported == {"count": 1, "refused": []}
        assert (await page.execute("GAP 4, 0"))["value"] == 777
        (row,) = await page.call(wire.ReadTracefile(encode(TRACEFILE)))
        assert (row["path"], row["executed"]) == ("Pr\u00fcfung.tmc", 3)

    _go(tmp_path, scenario)


@pytest.mark.parametrize("data", [SETTINGS.encode("utf-16-le"), codecs.BOM_UTF8 + b"\xff", b"SAP 4\0"])
def test_what_is_no_text_is_refused_with_the_reason(tmp_path, data):
    async def scenario(page):
        for call in (wire.ImportSettings(data), wire.ReadTracefile(data)):
            answer = await page.ask(call)
            assert (answer.code, answer.text.startswith("The file cannot be read: ")) == ("text", True)

    _go(tmp_path, scenario)
