"""Editors as they should not be: wrong lengths, deep and huge JSON, requests in any order, taken back, hung up on."""

import asyncio
import contextlib
import json
import random
import resource
import socket
import threading
from functools import cache

import pytest
from pygls.protocol import default_converter

from far_ends import far_end
from tmcm34x.cli.dap import SERVICES
from tmcm34x.debug.dap import Adapter
from tmcm34x.debug.dap.messages import LARGEST, Framing, FramingError, frame
from tmcm34x.editor import language_server
from tmcm34x.editor.disk import DiskFiles
from tmcm34x.editor.sessions import MOST_EDITORS, serve_messages, serve_tcp

URI = "file:///project/x.tmc"
ALIVE = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"processId": None, "capabilities": {}}}
NO_MESSAGES = (
    b"Content-Length: 0\r\n\r\n",
    b"Content-Length: -5\r\n\r\n{}",
    b"Content-Length: " + b"9" * 5000 + b"\r\n\r\n",
    b"Content-Length: 99999999999\r\n\r\n",
    b"Content-Length: x\r\n\r\n",
    b"Content-Length: 10\r\n\r\n{}",
    b"Content-Length: \xff\r\n\r\n",
    b"x" * 300_000,
    b"\r\n" * 50_000,
    b"GET / HTTP/1.1\r\nHost: x\r\n\r\n",
    random.Random(7).randbytes(5000),
)
TEXTS = (
    "[" * 100_000,
    '{"a":' * 50_000,
    "1" * 100_000,
    '{"jsonrpc": "2.0", "id": %s, "method": "shutdown"}' % ("9" * 5000),
    '{"jsonrpc": "2.0", "id": {}, "method": "shutdown"}',
    '{"jsonrpc": "2.0", "id": null, "method": null}',
    '{"jsonrpc": "2.0", "id": 3, "result": {}}',
    '{"jsonrpc": "2.0", "method": "$/cancelRequest", "params": {"id": 99}}',
    '{"jsonrpc": "2.0", "method": "$/cancelRequest", "params": {"id": []}}',
    '{"jsonrpc": "2.0", "method": "$/cancelRequest"}',
    '{"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": 3}',
    '{"jsonrpc": "2.0", "id": 7, "method": "textDocument/hover", "params": {}}',
    '{"jsonrpc": "1.0", "__proto__": {"def": 1, "class": 2, "9": 3}}',
    '"\\ud800"',
    "NaN",
    "\0",
)


# Language server


def converse(texts):
    """What one session in this process sends until it has answered request 1000."""
    received = []

    async def session():
        done = asyncio.Event()

        async def messages():
            for text in (*texts, json.dumps({**ALIVE, "id": 1000})):
                yield text
            await asyncio.wait_for(done.wait(), 60)

        async def send(text):
            received.append(json.loads(text))
            if received[-1].get("id") == 1000:
                done.set()

        await serve_messages(messages(), send, DiskFiles())

    asyncio.run(session())
    return received


def request(number, method, **params):
    return json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": params})


@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_the_language_server_answers_after_any_text(text, capfd):
    assert converse([text])[-1]["id"] == 1000
    assert "Traceback" not in capfd.readouterr().err


def test_the_language_server_takes_requests_in_the_wrong_order_and_taken_back(capfd):
    place = {"textDocument": {"uri": URI}, "position": {"line": 0, "character": 1}}
    far = {"textDocument": {"uri": URI}, "position": {"line": 2**31 - 1, "character": 2**31 - 1}}
    document = {"uri": URI, "languageId": "tmcl", "version": 1, "text": "ROR 0, 5\n" * 100}
    texts = [
        request(2, "textDocument/hover", **place),
        json.dumps(ALIVE),
        json.dumps({**ALIVE, "id": 3}),
        json.dumps(
            {"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": {"textDocument": document}}
        ),
        request(4, "textDocument/hover", **far),
    ]
    for number in range(10, 200, 2):
        texts.append(request(number, "textDocument/completion", **place))
        texts.append(json.dumps({"jsonrpc": "2.0", "method": "$/cancelRequest", "params": {"id": number}}))
    answered = [message["id"] for message in converse(texts) if "id" in message and "method" not in message]
    assert len(answered) == len(set(answered))
    assert {1, 2, 3, 4} <= set(answered)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.filterwarnings("error")
def test_bytes_that_are_no_messages_end_their_session_only(capfd, caplog):
    async def scenario():
        address = asyncio.get_running_loop().create_future()
        server = asyncio.create_task(
            serve_tcp("127.0.0.1", 0, DiskFiles(), ready=lambda host, port: address.set_result((host, port)))
        )
        host, port = await address
        for data in NO_MESSAGES:
            reader, writer = await asyncio.open_connection(host, port)
            writer.write(data)
            writer.write_eof()
            async with asyncio.timeout(60):
                with contextlib.suppress(ConnectionError):
                    await reader.read()
            writer.close()
        gone = (await asyncio.open_connection(host, port))[1]
        gone.write(frame(ALIVE) * 200)
        gone.transport.abort()
        reader, writer = await asyncio.open_connection(host, port)
        writer.write(frame(ALIVE))
        async with asyncio.timeout(60):
            assert await reader.readline()
        writer.close()
        server.cancel()
        await asyncio.gather(server, return_exceptions=True)

    asyncio.run(scenario())
    assert "Traceback" not in capfd.readouterr().err
    assert not [record.getMessage() for record in caplog.records if record.levelname == "ERROR"]


@contextlib.asynccontextmanager
async def listening(**options):
    """The address of a language server in this loop."""
    address = asyncio.get_running_loop().create_future()
    server = asyncio.create_task(
        serve_tcp("127.0.0.1", 0, DiskFiles(), ready=lambda *place: address.set_result(place), **options)
    )
    yield await address
    server.cancel()
    await asyncio.gather(server, return_exceptions=True)


@contextlib.asynccontextmanager
async def connected(address):
    """A further editor, and whether it is answered."""
    reader, writer = await asyncio.open_connection(*address)
    writer.write(frame(ALIVE))
    line = b""
    with contextlib.suppress(ConnectionError):
        line = await reader.readline()
    yield writer.get_extra_info("sockname"), bool(line)
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()


async def answered(address):
    """Whether a further editor is answered."""
    async with connected(address) as (_, answer):
        return answer


def ask_and_read_nothing(address):
    """An editor that goes on asking until its connection is reset."""
    with socket.create_connection(address, timeout=60) as connection:
        while True:
            connection.sendall(frame(ALIVE) * 100)


def test_an_editor_that_takes_nothing_is_reset_and_others_are_answered_meanwhile():
    async def scenario():
        async with listening(stall_s=0.2) as address:
            greedy = asyncio.create_task(asyncio.to_thread(ask_and_read_nothing, address))
            assert await answered(address)
            with pytest.raises(ConnectionError):
                await greedy
            assert await answered(address)

    asyncio.run(scenario())


def test_an_editor_that_sends_nothing_at_all_is_dropped():
    async def scenario():
        async with listening(first_s=0.05) as address:
            reader, writer = await asyncio.open_connection(*address)
            assert await reader.read() == b""
            writer.close()
            await writer.wait_closed()

    asyncio.run(scenario())


def test_more_editors_than_fit_are_reset_by_the_language_server():
    async def scenario():
        async with listening() as address, contextlib.AsyncExitStack() as stack:
            for _ in range(MOST_EDITORS):
                _, answer = await stack.enter_async_context(connected(address))
                assert answer
            assert not await answered(address)

    asyncio.run(scenario())


def test_an_editor_whose_computer_is_gone_is_found_out():
    async def scenario():
        async with listening() as address, connected(address) as (editor, _):
            assert far_end(editor).getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)

    asyncio.run(scenario())


# Debug adapter


def adapt(data, size=65536):
    """What an adapter sends for these bytes, and whether it went on to their end."""
    sent, framing = [], Framing()
    adapter = Adapter(sent.append, SERVICES)
    try:
        for at in range(0, len(data), size):
            for message in framing.feed(data[at : at + size]):
                adapter.handle(message)
    except FramingError as error:
        assert "\n" not in str(error)
        return sent, False
    finally:
        adapter.close()
    return sent, True


@pytest.mark.parametrize("data", NO_MESSAGES, ids=range(len(NO_MESSAGES)))
def test_the_debug_adapter_takes_any_bytes(data):
    for size in (1000, 65536):
        for message in adapt(data, size)[0]:
            assert message["success"] is False


@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_the_debug_adapter_answers_any_text(text):
    body = text.encode()
    framed = b"Content-Length: %d\r\n\r\n%s" % (len(body), body)
    sent, whole = adapt(framed + frame({"seq": 9, "type": "request", "command": "threads"}))
    assert whole
    assert sent[-1]["request_seq"] == 9
    assert all("\n" not in message.get("message", "") for message in sent)


def test_the_debug_adapter_takes_bytes_one_by_one_without_work_for_each_of_the_rest():
    text = json.dumps({"seq": 1, "type": "request", "command": "threads", "arguments": {"x": "y" * 200_000}})
    framed = b"Content-Length: %d\r\n\r\n%s" % (len(text), text.encode())
    assert len(adapt(framed, 16)[0]) == 1


@pytest.mark.parametrize(
    "expression",
    [
        "__import__('os').system('true')", "().__class__", "gp.__class__", "[x for x in ap]", "lambda: 1", "9**9**9**9",
        "1 << 99999999999", "(" * 5000, "-" * 50_000 + "1", "1" * 50_000, "gp[" * 3000, "ap[0][0]" * 5000, "'a' * 9**9",
        "f'{1}'", "gp[1] := 3", "0 / 0", "1 % 0", "\0", "\ud800", "a" * 90_000, "1 + " * 20_000 + "1",
        "open('/etc/passwd')",
        "~" * 20_000 + "1", "1 < " * 5000 + "1", "1 ? " * 2000, "x = = 3", "gp[1] = 1 = 2",
        "gp[99999999999]", "ap[-1][0]",
    ],
)  # fmt: skip
def test_expressions_never_become_python(expression, tmp_path):
    file, sent = tmp_path / "x.tmc", []
    file.write_text("Loop: SGP 1, 2, 3\nJA Loop\n")
    adapter = Adapter(sent.append, SERVICES)

    def ask(command, **arguments):
        adapter.handle({"seq": len(sent), "type": "request", "command": command, "arguments": arguments})
        return next(message for message in reversed(sent) if message["type"] == "response")

    assert ask("launch", program=str(file), stopOnEntry=True)["success"]
    for context in ("watch", "repl", "hover"):
        answer = ask("evaluate", expression=expression, context=context)
        assert "\n" not in answer.get("message", "")
        if answer["success"]:
            assert set(answer["body"]["result"]) <= set("-0123456789") or len(answer["body"]["result"]) < 200
    ask("setExpression", expression=expression, value=expression)
    ask("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 1, "condition": expression}])
    adapter.close()


def test_no_message_makes_a_reader_keep_more_than_it_announced():
    framing = Framing()
    with pytest.raises(FramingError):
        list(framing.feed(b"Content-Length: %d\r\n\r\n" % (LARGEST + 1)))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(FramingError):
        for _ in range(1000):
            list(Framing().feed(b"\0" * 65536))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


def test_two_editors_that_come_at_once_do_not_disturb_each_other(monkeypatch):
    makers = []

    def make():
        makers.append(threading.current_thread())
        other = threading.Thread(target=language_server.TmclServer, args=(DiskFiles(),))
        if len(makers) == 1:
            other.start()
            other.join(0.1)  # as far as it comes while the converter is being made
        return default_converter()

    monkeypatch.setattr(language_server, "_shared_converter", cache(make))
    before = {*threading.enumerate()}
    language_server.TmclServer(DiskFiles())
    for other in {*threading.enumerate()} - before:
        other.join()
    assert makers == [threading.current_thread()]
