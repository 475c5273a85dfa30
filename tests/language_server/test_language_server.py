"""The language server as editors drive it: real processes, real messages."""

import asyncio
import json
import queue
import re
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tmcm34x.editor.conversion import name_of, uri_of
from tmcm34x.editor.disk import DiskFiles
from tmcm34x.editor.sessions import serve_messages

URI = "file:///project/x.tmc"
PROGRAM = "Speed = 500 // größer 𝄞\nGo:     ROR   0, Speed\n        JA    Go\n"


class Client:
    """A scripted editor on the other end of a server's pipes."""

    def __init__(self, reader, writer):
        self.writer = writer
        self.number = 0
        self.answers = queue.Queue()
        self.notices = queue.Queue()
        self.thread = threading.Thread(target=self.pump, args=(reader,), daemon=True)
        self.thread.start()

    def pump(self, reader):
        while header := reader.readline():
            length = int(re.match(rb"content-length: (\d+)", header, re.IGNORECASE).group(1))
            while reader.readline().strip():
                pass
            message = json.loads(reader.read(length))
            (self.answers if "id" in message and "method" not in message else self.notices).put(message)

    def send(self, **message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.writer.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.writer.flush()

    def notify(self, method, **params):
        self.send(method=method, params=params)

    def ask(self, method, **params):
        self.number += 1
        self.send(id=self.number, method=method, params=params)
        answer = self.answers.get(timeout=60)
        assert answer["id"] == self.number
        return answer.get("result"), answer.get("error")

    def about(self, method, line, character, uri=URI, **more):
        place = {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}
        result, error = self.ask(f"textDocument/{method}", **place, **more)
        assert error is None, error
        return result

    def start(self, options=None, encodings=("utf-16",)):
        result, error = self.ask(
            "initialize",
            processId=None,
            rootUri=None,
            capabilities={"general": {"positionEncodings": list(encodings)}},
            initializationOptions=options,
        )
        assert error is None
        self.notify("initialized")
        return result

    def open(self, text, uri=URI):
        document = {"uri": uri, "languageId": "tmcl", "version": 1, "text": text}
        self.notify("textDocument/didOpen", textDocument=document)

    def change(self, text, uri=URI, version=2):
        self.notify(
            "textDocument/didChange",
            textDocument={"uri": uri, "version": version},
            contentChanges=[{"text": text}],
        )

    def diagnostics(self, uri=URI):
        """The next ones for a document."""
        while True:
            message = self.notices.get(timeout=60)
            if message["method"] == "textDocument/publishDiagnostics" and message["params"]["uri"] == uri:
                return message["params"]["diagnostics"]

    def codes(self, uri=URI):
        return [item["code"] for item in self.diagnostics(uri)]


@pytest.fixture(scope="module")
def process():
    command = [sys.executable, "-m", "tmcm34x", "lsp", "--stdio"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as running:
        client = Client(running.stdout, running.stdin)
        client.capabilities = client.start()["capabilities"]
        yield client
        assert client.ask("shutdown") == (None, None)
        client.notify("exit")
        running.stdin.close()
        assert running.wait(timeout=60) == 0


@pytest.fixture
def client(process):
    process.open(PROGRAM)
    assert process.diagnostics() == []
    yield process
    process.notify("textDocument/didClose", textDocument={"uri": URI})
    assert process.diagnostics() == []


def test_the_server_says_what_it_can(client):
    assert client.capabilities["textDocumentSync"]["change"] == 2
    for name in (
        "hover", "completion", "signatureHelp", "definition", "references", "documentSymbol", "documentFormatting",
        "rename", "foldingRange", "semanticTokens", "inlayHint", "codeAction", "documentHighlight",
    ):  # fmt: skip
        assert client.capabilities[f"{name}Provider"]


def test_diagnostics_follow_the_text(client):
    client.change("ROR 0, 1/0\nfoo")
    first, second = client.diagnostics()
    assert (first["code"], first["severity"], first["source"]) == ("E401", 1, "tmcl")
    assert first["range"] == {"start": {"line": 0, "character": 8}, "end": {"line": 0, "character": 9}}
    assert second["code"] == "E201"
    client.change("STOP", version=3)
    assert client.diagnostics() == []


def test_hover_completion_and_signature(client):
    hover = client.about("hover", 1, 9)
    assert hover["contents"]["kind"] == "markdown"
    assert "rotate right" in hover["contents"]["value"]
    assert hover["range"]["start"] == {"line": 1, "character": 8}
    assert client.about("hover", 0, 20) is None
    items = client.about("completion", 1, 20)["items"]
    speed = next(item for item in items if item["label"] == "Speed")
    assert speed["textEdit"]["range"]["start"] == {"line": 1, "character": 17}
    signature = client.about("signatureHelp", 1, 18)
    assert signature["signatures"][0]["label"] == "ROR <motor>, <velocity>"
    assert signature["activeParameter"] == 1


def test_definition_references_and_highlights(client):
    definition = client.about("definition", 2, 15)
    assert definition == {
        "uri": URI,
        "range": {"start": {"line": 1, "character": 0}, "end": {"line": 1, "character": 2}},
    }
    found = client.about("references", 2, 15, context={"includeDeclaration": True})
    assert [f["range"]["start"]["line"] for f in found] == [1, 2]
    assert len(client.about("documentHighlight", 1, 18)) == 2


def test_renaming_a_label_and_refusing_a_wrong_name(client):
    assert client.about("prepareRename", 2, 14)["start"] == {"line": 2, "character": 14}
    edit = client.about("rename", 2, 14, newName="Again")
    assert [e["newText"] for e in edit["changes"][URI]] == ["Again", "Again"]
    where = {"textDocument": {"uri": URI}, "position": {"line": 2, "character": 14}}
    _, error = client.ask("textDocument/rename", **where, newName="7up")
    assert "no name" in error["message"]


def test_changes_come_piece_by_piece(client):
    where = {"start": {"line": 0, "character": 8}, "end": {"line": 0, "character": 11}}
    end = {"start": {"line": 3, "character": 0}, "end": {"line": 3, "character": 0}}
    client.notify(
        "textDocument/didChange",
        textDocument={"uri": URI, "version": 2},
        contentChanges=[{"range": where, "text": "9999"}, {"range": end, "text": "\tROR 9, 1 // 𝄞\n"}],
    )
    found = client.diagnostics()
    assert [(item["code"], item["range"]["start"]["line"]) for item in found] == [
        ("W307", 1),
        ("W101", 3),
        ("W303", 3),
    ]
    client.change(PROGRAM, version=3)
    assert client.diagnostics() == []


def test_what_is_refused_leaves_nothing_in_the_log(tmp_path):
    command = [sys.executable, "-m", "tmcm34x", "lsp", "--stdio"]
    log = tmp_path / "log"
    with (
        log.open("wb") as errors,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors) as running,
    ):
        client = Client(running.stdout, running.stdin)
        client.start()
        client.open(PROGRAM)
        assert client.diagnostics() == []
        where = {"textDocument": {"uri": URI}, "position": {"line": 0, "character": 7}}
        _, error = client.ask("textDocument/rename", **where, newName="Again")
        assert "no label or constant" in error["message"]
        client.ask("shutdown")
        client.notify("exit")
        running.stdin.close()
        running.wait(timeout=60)
    assert log.read_text() == ""


def test_symbols_folds_tokens_and_hints(client):
    document = {"textDocument": {"uri": URI}}
    symbols, _ = client.ask("textDocument/documentSymbol", **document)
    assert [(s["name"], s["detail"]) for s in symbols] == [("Speed", "= 500"), ("Go", "address 0")]
    folds, _ = client.ask("textDocument/foldingRange", **document)
    assert folds == [{"startLine": 1, "endLine": 2, "kind": "region"}]
    tokens, _ = client.ask("textDocument/semanticTokens/full", **document)
    assert len(tokens["data"]) % 5 == 0
    assert tokens["data"][15:20] == [0, 4, 12, 6, 0], "the comment has a character of two units"
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 9, "character": 0}}
    part, _ = client.ask("textDocument/semanticTokens/range", **document, range=whole)
    assert part == tokens
    hints, _ = client.ask("textDocument/inlayHint", **document, range=whole)
    assert [h["label"] for h in hints] == ["0000", "238.4 steps/s", "0001"]


def test_formatting_and_code_actions(client):
    client.change("STOP\nROR 9, 1 // 𝄞\nSTOP")
    client.diagnostics()
    document = {"textDocument": {"uri": URI}}
    edits, _ = client.ask("textDocument/formatting", **document, options={"tabSize": 4, "insertSpaces": True})
    assert edits[0]["newText"] == "        STOP"
    assert edits[1]["range"]["end"] == {"line": 1, "character": 14}
    everything = {"start": {"line": 0, "character": 0}, "end": {"line": 2, "character": 0}}
    actions, _ = client.ask(
        "textDocument/codeAction", **document, range=everything, context={"diagnostics": []}
    )
    assert "Ignore W303 on this line" in [a["title"] for a in actions]
    edit = next(a for a in actions if "W303" in a["title"])["edit"]["changes"][URI][0]
    assert edit["range"]["start"] == {"line": 1, "character": 14}


def test_included_files_are_read_from_disk_and_judged_with_their_program(client, tmp_path):
    (tmp_path / "names.inc").write_text("Top = 5\n")
    main, names = ((tmp_path / name).as_uri() for name in ("main.tmc", "names.inc"))
    client.open("#include names.inc\nROR 0, Top\nSTOP", main)
    assert client.diagnostics(main) == []
    client.open("Topp = 5\n", names)
    assert client.codes(main) == ["E301"]
    assert client.codes(names) == []
    client.change("Top = 5\n", names)
    assert client.codes(main) == []
    definition = client.about("definition", 1, 8, uri=main)
    assert definition["uri"] == names
    for uri in (main, names):
        client.notify("textDocument/didClose", textDocument={"uri": uri})


def test_the_configuration_sets_model_and_hints(client):
    client.change("SAP 6, 0, 5\nSTOP")
    assert client.codes() == []
    client.notify("workspace/didChangeConfiguration", settings={"tmcl": {"model": 342, "hints": ["value"]}})
    assert client.codes() == ["W302"]
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 9, "character": 0}}
    hints, _ = client.ask("textDocument/inlayHint", textDocument={"uri": URI}, range=whole)
    assert hints == []
    options = {"model": 343, "hints": ["address", "parameter", "value"]}
    client.notify("workspace/didChangeConfiguration", settings={"tmcl": options})
    assert client.codes() == []


def test_questions_about_files_that_are_not_open_are_refused(client):
    _, error = client.ask("textDocument/documentSymbol", textDocument={"uri": "file:///none"})
    assert error["message"] == "not open: file:///none"


def test_wrong_messages_leave_the_server_alive(client):
    client.notify("no/such/notification", x=1)
    _, error = client.ask("no/such/request")
    assert error["code"] == -32601
    assert client.about("hover", 1, 9)


def test_diagnostics_of_a_long_program_follow_each_change(client):
    """2,048 lines; how soon they come is measured by benchmarks/bench_editor.py."""
    lines = ["L0:"] + [f"        MVP ABS, {n % 3}, {n} * 2 // move" for n in range(2046)] + ["        JA L0"]
    client.change("\n".join(lines))
    client.diagnostics()
    for turn in range(3):
        lines[1000 + turn] = f"        MVP ABS, 0, {turn} + oops"
        client.change("\n".join(lines))
        assert client.codes().count("E301") == turn + 1


# As Visual Studio Code does it

MOVE = """\
// Moves motor 0 and counts.
#include speeds.inc

// #region set-up
        SAP   4, 0, Speed
        SGP   1, 2, 0
// #endregion

Loop:   CSUB  Move
        COMP  3
        JC    LT, Loop
        STOP

Move:   MVP   REL, 0, 10000
        WAIT  POS, 0, 0
        RSUB
"""


@pytest.fixture
def vscode(tmp_path):
    """A server, initialized with all that Visual Studio Code 1.139 says of itself, and an open program."""
    (tmp_path / "speeds.inc").write_text("Speed = 500    // of every move\n")
    params = json.loads(Path(__file__).with_name("vscode.json").read_text())
    root = tmp_path.as_uri()
    params |= {"processId": None, "rootPath": str(tmp_path), "rootUri": root}
    params["workspaceFolders"] = [{"uri": root, "name": "project"}]
    command = [sys.executable, "-m", "tmcm34x", "lsp"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path
    ) as running:
        client = Client(running.stdout, running.stdin)
        _, error = client.ask("initialize", **params)
        assert error is None
        client.notify("initialized")
        client.uri = (tmp_path / "move.tmc").as_uri()
        client.open(MOVE, client.uri)
        settings = {"command": "tmcm34x", **params["initializationOptions"]}
        client.notify("workspace/didChangeConfiguration", settings={"tmcl": settings})
        assert client.diagnostics(client.uri) == []
        yield client
        client.notify("textDocument/didClose", textDocument={"uri": client.uri})
        assert client.ask("shutdown") == (None, None)
        client.notify("exit")
        assert running.wait(timeout=60) == 0
        assert running.stderr.read() == b""


def span(first_line, first, last_line, last):
    return {
        "start": {"line": first_line, "character": first},
        "end": {"line": last_line, "character": last},
    }


def test_visual_studio_code_opens_a_program(vscode):
    def ask(method, **more):
        result, error = vscode.ask(f"textDocument/{method}", textDocument={"uri": vscode.uri}, **more)
        assert error is None, error
        return result

    whole = span(0, 0, 16, 0)
    symbols = ask("documentSymbol")
    assert [(s["name"], s["kind"], s["range"]["end"]["line"]) for s in symbols] == [
        ("Loop", 20, 11), ("Move", 12, 15),
    ]  # fmt: skip
    assert ask("codeAction", range=span(0, 0, 0, 0), context={"diagnostics": [], "triggerKind": 2}) == []
    hints = ask("inlayHint", range=whole)
    assert [h["label"] for h in hints[:3]] == ["0000", "maximum positioning speed", "238.4 steps/s"]
    assert ask("inlayHint", range=span(8, 0, 9, 0)) == [h for h in hints if 8 <= h["position"]["line"] <= 9]
    assert [(f["startLine"], f["endLine"]) for f in ask("foldingRange")] == [(3, 6), (8, 11), (13, 15)]
    tokens = ask("semanticTokens/range", range=whole)
    assert tokens == ask("semanticTokens/full") and len(tokens["data"]) > 100
    part = ask("semanticTokens/range", range=span(13, 0, 13, 99))["data"]
    assert part[:2] == [13, 0] and len(part) < len(tokens["data"])
    assert len(ask("documentHighlight", position={"line": 8, "character": 1})) == 2
    hover = ask("hover", position={"line": 13, "character": 8})
    assert hover["contents"]["kind"] == "markdown" and hover["range"] == span(13, 8, 13, 11)
    definition = ask("definition", position={"line": 4, "character": 23})
    assert definition["uri"].endswith("/speeds.inc") and definition["range"] == span(0, 0, 0, 5)


def test_visual_studio_code_types_a_command(vscode):
    lines = MOVE.split("\n")

    def type_(text, version):
        lines[11] = text
        vscode.change("\n".join(lines), vscode.uri, version)

    def ask(method, character, **more):
        return vscode.about(method, 11, character, uri=vscode.uri, **more)

    typed = {"triggerKind": 2, "triggerCharacter": " "}
    type_("        SAP ", 2)
    items = ask("completion", 12, context=typed)["items"]
    assert (items[0]["label"], items[0]["textEdit"]["range"]) == (
        "0 target (next) position",
        span(11, 12, 11, 12),
    )
    help_ = ask("signatureHelp", 12, context={**typed, "isRetrigger": False})
    assert help_["signatures"][0]["activeParameter"] == help_["activeParameter"] == 0
    type_("        SAP 4, ", 3)
    again = {**typed, "isRetrigger": True, "activeSignatureHelp": help_}
    help_ = ask("signatureHelp", 15, context=again)
    assert help_["signatures"][0]["activeParameter"] == help_["activeParameter"] == 1
    vscode.notify("$/cancelRequest", id=vscode.number)
    type_("        SAP 4, 9, Speed", 4)
    found = vscode.diagnostics(vscode.uri)
    while not found or found[0]["code"] != "W303":
        found = vscode.diagnostics(vscode.uri)
    here = {"textDocument": {"uri": vscode.uri}, "range": found[0]["range"]}
    actions, _ = vscode.ask(
        "textDocument/codeAction", **here, context={"diagnostics": found, "triggerKind": 1}
    )
    assert [a["title"] for a in actions] == ["Ignore W303 on this line"]
    assert actions[0]["diagnostics"] == found[:1]
    saving = {"diagnostics": [], "only": ["source.organizeImports"], "triggerKind": 2}
    assert vscode.ask("textDocument/codeAction", **here, context=saving) == ([], None)
    options = {"tabSize": 8, "insertSpaces": True}
    edits, _ = vscode.ask("textDocument/formatting", textDocument={"uri": vscode.uri}, options=options)
    assert edits == [{"range": span(11, 0, 11, 23), "newText": "        SAP   4, 9, Speed"}]


def test_visual_studio_code_renames_a_constant_of_another_file(vscode):
    place = vscode.about("prepareRename", 4, 22, uri=vscode.uri)
    assert place == span(4, 20, 4, 25)
    edit = vscode.about("rename", 4, 22, uri=vscode.uri, newName="Pace")
    assert {uri.rpartition("/")[2]: len(edits) for uri, edits in edit["changes"].items()} == {
        "move.tmc": 1, "speeds.inc": 1,
    }  # fmt: skip
    assert vscode.about("prepareRename", 0, 4, uri=vscode.uri) is None


# Other ways to it


def test_tcp_serves_several_editors_one_after_the_other():
    command = [sys.executable, "-m", "tmcm34x", "lsp", "--tcp", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        _, kind, address = running.stdout.readline().split()
        assert kind == "lsp"
        host, _, port = address.rpartition(":")
        for _ in range(2):
            with socket.create_connection((host, int(port)), timeout=60) as connection:
                stream = connection.makefile("rwb")
                client = Client(stream, stream)
                client.start()
                client.open("foo 1")
                assert client.codes() == ["E201"]
                client.ask("shutdown")
                client.notify("exit")
                client.thread.join(timeout=60)
                assert not client.thread.is_alive()
        running.terminate()
        running.wait(timeout=60)


@pytest.mark.parametrize("arguments", [["--tcp", "here"], ["--tcp", "1:2:99999"], ["--stdio", "--tcp", "1"]])
def test_wrong_addresses_give_status_2(arguments):
    command = [sys.executable, "-m", "tmcm34x", "lsp", *arguments]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1


def converse(texts, until):
    """One session in this process: sends `texts`, gives back what came until `until` is content."""
    received = []

    async def session():
        done = asyncio.Event()

        async def messages():
            for text in texts:
                yield text
            await asyncio.wait_for(done.wait(), 60)

        async def send(text):
            received.append(json.loads(text))
            if until(received):
                done.set()

        await serve_messages(messages(), send, DiskFiles())

    asyncio.run(session())
    return received


NOBODY = {"processId": None, "rootUri": None, "capabilities": {}}
INITIALIZE = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": NOBODY})


def test_a_session_over_messages_answers_rubbish_with_a_parse_error():
    rubbish = [
        "no json",
        "[]",
        "{}",
        '"x"',
        "[" * 100_000,
        b"\xff\xfe",
        '{"jsonrpc": "2.0", "id": 5, "method": 7}',
    ]
    received = converse([*rubbish, INITIALIZE], lambda messages: any(m.get("id") == 1 for m in messages))
    assert {m["error"]["code"] for m in received if "error" in m} == {-32700}
    assert received[-1]["result"]["serverInfo"]["name"] == "tmcm34x"


def test_exit_ends_the_session_and_not_the_process():
    exit_message = json.dumps({"jsonrpc": "2.0", "method": "exit"})
    assert converse([INITIALIZE, exit_message, "never read"], lambda messages: False)


def test_columns_are_counted_in_the_client_s_units():
    opened = {"uri": "untitled:1", "languageId": "tmcl", "version": 1, "text": "// 𝄞\nX: foo // 𝄞\n𝄞"}
    for encoding, units in (("utf-8", 4), ("utf-16", 2), ("utf-32", 1)):
        initialize = json.loads(INITIALIZE)
        initialize["params"]["capabilities"] = {"general": {"positionEncodings": [encoding]}}
        notice = {"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": {"textDocument": opened}}
        received = converse(
            [json.dumps(initialize), json.dumps(notice)],
            lambda messages: any(m.get("method") == "textDocument/publishDiagnostics" for m in messages),
        )
        (last,) = [d for d in received[-1]["params"]["diagnostics"] if d["code"] == "E101"]
        assert last["range"]["end"] == {"line": 2, "character": units}


def test_names_are_paths_and_uris_are_themselves():
    assert name_of("file:///a%20b/c.tmc") == "/a b/c.tmc"
    assert uri_of("/a b/c.tmc") == "file:///a%20b/c.tmc"
    assert uri_of(name_of("untitled:Untitled-1")) == "untitled:Untitled-1"
