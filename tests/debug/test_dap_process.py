"""The debug adapter as an editor meets it: a process, over its pipes or a socket."""

import contextlib
import select
import signal
import socket
import subprocess
import threading

import pytest

from conftest import PATIENCE_S
from debug.vscode import COMMAND, VSCODE, Client, held
from tmcm34x.cli import dap_socket
from tmcm34x.cli.dap_socket import MOST_EDITORS
from tmcm34x.debug.dap.messages import frame
from tmcm34x.host import Connection, Program
from tmcm34x.toolchain.assembler import assemble

PROGRAM = """\
        SGP   1, 2, 0
Loop:   CSUB  Move
        GGP   1, 2
        COMP  2
        JC    LT, Loop
        STOP
Move:   MVP   REL, 0, 1000
        WAIT  POS, 0, 0
        GGP   1, 2
        CALC  ADD, 1
        AGP   1, 2
        RSUB
"""
ENDLESS = "Loop: SGP 1, 2, 1\n      CSUB Sub\n      WAIT TICKS, 0, 1\n      JA Loop\nSub:  SGP 2, 2, 9\n      RSUB\n"


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "program.tmc"
    path.write_text(PROGRAM)
    return path


@pytest.fixture
def adapter():
    process = subprocess.Popen(
        [COMMAND, "dap"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    yield process
    if process.poll() is None:
        process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout, process.stderr):
        stream.close()


@pytest.fixture
def client(adapter):
    return Client(adapter.stdout, adapter.stdin)


def configure(client, file, breakpoints):
    """What Visual Studio Code sends when the adapter is ready for it."""
    client.event("initialized")
    source = {"name": file.name, "path": str(file)}
    if breakpoints:
        lines = [row["line"] for row in breakpoints]
        answer = client.do(
            "setBreakpoints", source=source, lines=lines, breakpoints=breakpoints, sourceModified=False
        )
        assert [(row["verified"], row["line"]) for row in answer["breakpoints"]] == [(True, n) for n in lines]
    client.do("setFunctionBreakpoints", breakpoints=[])
    client.do("setInstructionBreakpoints", breakpoints=[])
    client.do("setExceptionBreakpoints", filters=["refused"])
    for row in breakpoints:
        places = client.do("breakpointLocations", source=source, line=row["line"])["breakpoints"]
        assert places == [{"line": row["line"]}]
    client.do("configurationDone")


def debug(client, file):
    """What Visual Studio Code sends, in its order, from start to end."""
    capabilities = client.do("initialize", **VSCODE)
    assert capabilities["supportsConfigurationDoneRequest"]
    settings = {
        "model": 343, "include": [], "type": "tmcl", "request": "launch", "name": "Here", "program": str(file),
        "stopOnEntry": True, "__configurationTarget": 6, "__sessionId": "221fa801-b99b-4b36-80f8-22da0873f6d7",
    }  # fmt: skip
    launch = client.send("launch", **settings)
    told = {"line": 9, "column": 1, "logMessage": "turn {gp[1]} at {ap[1][0]}"}
    configure(client, file, [{"line": 3}, {"line": 4, "condition": "gp[1] == 2"}, told])
    assert launch == 2
    lines, registers, rows = held(client, "entry")
    assert lines == [1] and rows[0]["name"] == "accumulator"
    answer = client.do("setVariable", variablesReference=registers, name="accumulator", value="77")
    assert answer["value"] == "77"
    watch = {"frameId": 0, "context": "watch"}
    assert client.do("evaluate", expression="accumulator * 10", **watch)["result"] == "770"
    assert not client.ask("evaluate", expression="nonsense(", **watch)["success"]
    place = {"line": 7, "column": 9, "source": {"name": file.name, "path": str(file)}}
    assert client.do("evaluate", expression="Move", frameId=0, context="hover", **place)["result"] == "6"
    assert not client.ask("evaluate", expression="MVP", frameId=0, context="hover", **place)["success"]
    code = client.do(
        "disassemble", memoryReference="0x0", offset=0, instructionOffset=-50, instructionCount=100,
        resolveSymbols=True,
    )["instructions"]  # fmt: skip
    assert len(code) == 100 and code[50 + 6]["symbol"] == "Move"
    client.do("next", threadId=1)
    assert held(client, "step")[0] == [2]
    client.do("stepIn", threadId=1)
    assert held(client, "step")[0] == [7, 2]
    client.do("stepOut", threadId=1)
    assert client.event("output")["output"] == "turn 0 at 1000\n"
    assert held(client, "breakpoint")[0] == [3]
    client.do("continue", threadId=1)
    assert client.event("output")["output"] == "turn 1 at 2000\n"
    assert held(client, "breakpoint")[0] == [3]
    client.do("continue", threadId=1)
    assert held(client, "breakpoint")[0] == [4]
    names = client.do("completions", frameId=0, text="acc", column=4, line=1)["targets"]
    assert names[0]["label"] == "accumulator"
    repl = {"frameId": 0, "context": "repl"}
    assert client.do("evaluate", expression="gp[3] = 2 * gp[1] + Move", **repl)["result"] == "10"
    assert client.do("evaluate", expression="GAP 1, 0", **repl)["result"] == "2000"
    assert "wrong type" in client.ask("evaluate", expression="GAP 77, 0", **repl)["message"]
    client.do("restart", arguments=settings)
    assert held(client, "entry")[0] == [1]
    source = {"name": file.name, "path": str(file)}
    client.do("setBreakpoints", source=source, lines=[], breakpoints=[], sourceModified=False)
    client.do("continue", threadId=1)
    assert client.event("exited")["exitCode"] == 0
    client.event("terminated")
    client.do("disconnect", restart=False, terminateDebuggee=False)


def test_a_session_over_pipes(adapter, client, file):
    debug(client, file)
    assert adapter.wait(PATIENCE_S) == 0
    assert adapter.stderr.read() == b""


@pytest.fixture
def listening():
    """The address of an adapter that serves editors on a socket."""
    process = subprocess.Popen(
        [COMMAND, "dap", "--listen", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    word, kind, address = process.stdout.readline().decode().split()
    host, _, port = address.rpartition(":")
    assert (word, kind, host) == ("ready", "dap", "127.0.0.1")
    yield host, int(port)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert b"Traceback" not in errors and process.returncode == 0


@contextlib.contextmanager
def editor(address):
    """An editor at the other end of a socket."""
    with (
        socket.create_connection(address, timeout=PATIENCE_S) as connection,
        connection.makefile("rb") as reader,
        connection.makefile("wb") as writer,
    ):
        yield Client(reader, writer)


def test_sessions_over_a_socket_one_after_the_other(listening, file):
    for _ in range(2):
        with editor(listening) as client:
            debug(client, file)
    with socket.create_connection(listening, timeout=PATIENCE_S) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\n\r\n")
        with connection.makefile("rb") as reader:
            assert b'"success":false' in reader.read()


def test_editors_on_a_socket_do_not_wait_for_each_other(listening, file):
    with socket.create_connection(listening) as silent, socket.create_connection(listening) as greedy:
        greedy.setblocking(False)  # It asks as long as something fits, and reads nothing of what it gets.
        with contextlib.suppress(BlockingIOError):
            while True:
                greedy.send(frame({"seq": 1, "type": "request", "command": "initialize"}) * 100)
        with editor(listening) as first, editor(listening) as second:
            first.do("initialize", **VSCODE)
            debug(second, file)
            assert first.do("threads")
        assert silent.fileno() >= 0


def test_more_editors_than_fit_are_reset(listening):
    with contextlib.ExitStack() as stack:
        clients = [stack.enter_context(editor(listening)) for _ in range(MOST_EDITORS)]
        for client in clients:
            assert client.do("initialize", **VSCODE)
        with pytest.raises((ConnectionError, AssertionError)), editor(listening) as client:
            client.do("initialize", **VSCODE)


@pytest.fixture
def sockets():
    """Two ends of a connection."""
    with dap_socket.listen("127.0.0.1", 0) as server:
        near = socket.create_connection(server.getsockname())
        far = server.accept()[0]
    with near, far:
        yield near, far


def test_an_editor_that_takes_nothing_is_given_up(sockets):
    near, far = sockets
    editor = dap_socket.Editor(near, stall_s=0.01)
    with pytest.raises(ConnectionError):
        while True:
            editor.write(bytes(1 << 20))
    editor.close()
    with pytest.raises(ConnectionError):
        while far.recv(1 << 20):
            pass


def test_an_editor_may_be_silent_once_it_has_said_something(sockets):
    near, far = sockets
    editor = dap_socket.Editor(near, stall_s=0.01)
    assert editor.read() == b""
    far.sendall(b"a")
    select.select([near], [], [], PATIENCE_S)
    assert editor.read() == b"a"
    ready = threading.Event()
    reading = threading.Thread(target=lambda: (ready.set(), received.append(editor.read())))
    received = []
    reading.start()
    ready.wait()
    reading.join(0.05)  # some times as long as it may take nothing
    far.sendall(b"b")
    reading.join()
    assert received == [b"b"]


def test_an_editor_whose_computer_is_gone_is_found_out(sockets):
    near, _ = sockets
    dap_socket.Editor(near)
    assert near.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)


def test_a_pause_reaches_a_program_that_never_waits(client, tmp_path):
    file = tmp_path / "busy.tmc"
    file.write_text("Loop: CALC ADD, 1\n      AGP 1, 2\n      GIO 0, 0\n      GGP 132, 0\n      JA Loop\n")
    client.do("initialize", adapterID="tmcl")
    client.do("launch", program=str(file))
    client.do(
        "setBreakpoints",
        source={"path": str(file)},
        breakpoints=[{"line": 1, "condition": "accumulator == -1"}],
    )
    client.do("configurationDone")
    client.do("pause", threadId=1)
    assert client.event("stopped")["reason"] == "pause"
    client.do("disconnect")


def test_rubbish_ends_the_session_with_one_line(adapter):
    adapter.stdin.write(b"\x00\xff" * 4000)
    adapter.stdin.flush()
    assert adapter.wait(PATIENCE_S) == 0
    assert adapter.stderr.read().count(b"\n") == 1
    assert b'"success":false' in adapter.stdout.read()


def test_a_message_that_is_no_json_is_answered(adapter, client):
    adapter.stdin.write(b"Content-Length: 5\r\n\r\n{bad}")
    adapter.stdin.flush()
    assert client.next()["success"] is False
    assert client.do("initialize", adapterID="tmcl")


def test_an_editor_that_hangs_up_ends_the_process(adapter, client, file):
    client.do("launch", program=str(file))
    adapter.stdin.close()
    assert adapter.wait(PATIENCE_S) == 0


@pytest.mark.parametrize("where", ["host:name", "1.2.3.4", "127.0.0.1:99999", "203.0.113.1:0"])
def test_an_address_that_cannot_be_served_is_told(where):
    result = subprocess.run([COMMAND, "dap", "--listen", where], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr.count("\n")) == (2, 1) or "203" in where
    assert result.returncode == 2 and "Traceback" not in result.stderr


@pytest.fixture
def served(serve, tmp_path):
    file = tmp_path / "endless.tmc"
    file.write_text(ENDLESS)
    return serve("--tcp", "127.0.0.1:0"), file


def attach(client, served, **options):
    client.do("initialize", adapterID="tmcl")
    client.do("attach", port=served.tcp, **options)
    client.event("initialized")


def download(served, source):
    with Connection.open(served.tcp) as connection:
        Program(connection).download(assemble(source).program)


def test_a_served_module_is_run_stepped_and_stopped(client, served):
    module, file = served
    download(module, ENDLESS)
    attach(client, module, program=str(file))
    answer = client.do("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 1}])[
        "breakpoints"
    ][0]
    assert answer["verified"] and "single steps" in answer["message"]
    client.do("setBreakpoints", source={"path": str(file)}, breakpoints=[])
    client.do("configurationDone")
    assert client.event("stopped")["reason"] == "pause"

    def place():
        return client.do("stackTrace", threadId=1)["stackFrames"][0]["line"]

    def step(command):
        client.do(command, threadId=1)
        assert client.event("stopped")["reason"] == "step"
        return place()

    assert place() == 1
    assert [step("next"), step("stepIn"), step("stepOut")] == [2, 5, 3]
    assert [step("next"), step("next"), step("next"), step("next")] == [4, 1, 2, 3]
    assert client.do("evaluate", expression="gp[2] + counter", context="watch")["result"] == "11"
    assert not client.ask("evaluate", expression="accumulator", context="watch")["success"]
    client.do("continue", threadId=1)
    client.do("pause", threadId=1)
    assert client.event("stopped")["reason"] == "pause"
    assert client.do("evaluate", expression="SGP 9, 2, 77", context="repl")["result"].startswith("status 100")
    assert client.do("evaluate", expression="gp[9]", context="hover")["result"] == "77"
    scopes = client.do("scopes", frameId=0)["scopes"]
    assert scopes[0]["name"] == "User variables" and scopes[0]["expensive"]
    assert len(client.do("variables", variablesReference=scopes[0]["variablesReference"])["variables"]) == 56
    assert not client.ask("goto", threadId=1, targetId=1)["success"]
    client.do("restart")
    client.do("terminate")
    client.event("terminated")
    client.do("disconnect")


def test_visual_studio_code_looks_into_a_served_module(adapter, client, served):
    module, file = served
    download(module, ENDLESS)
    client.do("initialize", **VSCODE)
    client.send(
        "attach", include=[], type="tmcl", request="attach", name="Module", program=str(file), port=module.tcp,
        __configurationTarget=6, __sessionId="8812847c-67f2-4f9b-95c6-cf7d06bf5a45",
    )  # fmt: skip
    configure(client, file, [])
    lines, _, rows = held(client, "pause")
    assert lines == [1] and rows[1]["name"] == "gp[1]"
    client.do("stepIn", threadId=1)
    lines, variables, _ = held(client, "step")
    assert lines == [2]
    assert client.do("setVariable", variablesReference=variables, name="gp[4]", value="5")["value"] == "5"
    client.do("continue", threadId=1)
    client.do("pause", threadId=1)
    assert held(client, "pause")[2][4]["value"] == "5"
    client.do("continue", threadId=1)
    client.do("disconnect", restart=False, terminateDebuggee=False)
    assert adapter.wait(PATIENCE_S) == 0
    with Connection.open(module.tcp) as connection:
        assert Program(connection).state.status == 1, "a disconnected editor leaves the program alone"


def test_a_program_without_source_is_shown_disassembled(client, served):
    module, _ = served
    download(module, ENDLESS)
    attach(client, module)
    client.do("configurationDone")
    assert client.event("stopped")["reason"] == "pause"
    frame = client.do("stackTrace", threadId=1)["stackFrames"][0]
    assert frame["source"]["sourceReference"] == 1
    assert "CSUB" in client.do("source", sourceReference=1)["content"]
    assert client.do("disassemble", memoryReference="0x0", instructionCount=1)["instructions"][0]["line"] == 1


def test_another_program_than_the_source_is_told(client, served):
    module, file = served
    download(module, PROGRAM)
    client.do("initialize", adapterID="tmcl")
    client.do("attach", port=module.tcp, program=str(file), stopOnEntry=True)
    while "another program" not in client.event("output")["output"]:
        pass


def test_a_program_that_ends_by_itself_is_told(client, served):
    module, _ = served
    download(module, "SGP 1, 2, 5\nSTOP\n")
    attach(client, module)
    client.do("configurationDone")
    client.event("stopped")
    client.do("continue", threadId=1)
    assert client.event("stopped")["description"] == "The program has stopped"


def test_a_module_that_goes_away_ends_the_session(client, served):
    module, _ = served
    download(module, ENDLESS)
    attach(client, module, timeout=1)
    client.do("configurationDone")
    client.do("continue", threadId=1)
    module.stop()
    client.event("terminated")
    assert not client.ask("evaluate", expression="gp[1]")["success"]
    scopes = client.do("scopes", frameId=0)["scopes"]
    assert not client.ask("variables", variablesReference=scopes[0]["variablesReference"])["success"]
    client.do("disconnect")
