from __future__ import annotations

import asyncio
import itertools
import json
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection

from ide.ide_driver import running


class Editor:
    """An editor at the other end of the page's language socket."""

    def __init__(self, connection: ClientConnection, folder: Path) -> None:
        self._connection = connection
        self._numbers = itertools.count(1)
        self.folder = folder

    def uri(self, name: str) -> str:
        return (self.folder / name).as_uri()

    async def notify(self, method: str, **params: Any) -> None:
        await self._connection.send(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))

    async def ask(self, method: str, **params: Any) -> Any:
        number = next(self._numbers)
        await self._connection.send(
            json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": params})
        )
        return (await self._next(lambda message: message.get("id") == number))["result"]

    async def diagnostics(self, name: str) -> list[dict[str, Any]]:
        message = await self._next(
            lambda message: (
                message.get("method") == "textDocument/publishDiagnostics"
                and message["params"]["uri"] == self.uri(name)
            )
        )
        return message["params"]["diagnostics"]

    async def _next(self, wanted: Any) -> dict[str, Any]:
        async with asyncio.timeout(60):
            while True:
                message = json.loads(await self._connection.recv())
                if wanted(message):
                    return message

    async def open(self, name: str, text: str) -> None:
        await self.ask("initialize", processId=None, rootUri=self.folder.as_uri(), capabilities={})
        await self.notify("initialized")
        await self.notify(
            "textDocument/didOpen",
            textDocument={"uri": self.uri(name), "languageId": "tmcl", "version": 0, "text": text},
        )


def _go(folder: Path, scenario: Any) -> None:
    async def run() -> None:
        async with running(folder) as ide, ide.socket("/lsp") as connection:
            await scenario(Editor(connection, ide.hub.workspace.folder))

    asyncio.run(run())


def test_the_pages_editor_has_the_language_server(tmp_path):
    async def scenario(editor: Editor):
        await editor.open("a.tmc", "ROR 0, 500\nJA Nowhere\n")
        found = await editor.diagnostics("a.tmc")
        assert [item["range"]["start"]["line"] for item in found if item["severity"] == 1] == [1]
        hover = await editor.ask(
            "textDocument/hover",
            textDocument={"uri": editor.uri("a.tmc")},
            position={"line": 0, "character": 1},
        )
        assert "rotate right" in hover["contents"]["value"]

    _go(tmp_path, scenario)


def test_an_included_file_is_read_inside_the_folder_only(tmp_path):
    (tmp_path / "secret.inc").write_text("Secret = 1\n")
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / "words.inc").write_text("Speed = 5\n")
    (folder / "circle.inc").symlink_to("circle.inc")
    (folder / "up").symlink_to("..")
    refused = [
        "../secret.inc", "up/secret.inc", "circle.inc", "circle.inc/../up/secret.inc", "a\0b", "a\0b/c", "x" * 300,
    ]  # fmt: skip

    async def scenario(editor: Editor):
        lines = [
            "#include words.inc",
            *(f'#include "{name}"' for name in refused),
            "ROR 0, Speed",
            "STOP",
            "",
        ]
        await editor.open("a.tmc", "\n".join(lines))
        found = await editor.diagnostics("a.tmc")
        assert [item["range"]["start"]["line"] for item in found if item["severity"] == 1] == [*range(1, 8)]

    _go(folder, scenario)


def test_rubbish_on_the_language_socket_harms_nobody(tmp_path):
    async def scenario(editor: Editor):
        await editor._connection.send("rubbish")
        await editor.open("a.tmc", "STOP\n")
        assert await editor.diagnostics("a.tmc") == []

    _go(tmp_path, scenario)
