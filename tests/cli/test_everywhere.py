"""Nothing that a person needs for a real module, or without terminals, imports what only POSIX systems have."""

import json
import subprocess
import sys

import pytest

HIDE = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name in {"fcntl", "termios", "pty", "tty"}:
            raise ModuleNotFoundError(f"no module named {name!r}: hidden", name=name)
sys.meta_path.insert(0, Hidden())
for name in ("fcntl", "termios", "pty", "tty"):
    sys.modules.pop(name, None)
import importlib.util
_find = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name == "termios" else _find(name, package)
"""
RUN = f"{HIDE}\nfrom tmcm34x.cli import main\nmain()\n"


def start(*arguments, **options):
    return subprocess.Popen(
        [sys.executable, "-c", RUN, *map(str, arguments)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def run(*arguments, text=""):
    with start(*arguments) as process:
        output, errors = process.communicate(text, timeout=60)
    assert "hidden" not in errors, errors
    return process.returncode, output, errors


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "program.tmc"
    path.write_text("MVP ABS, 0, 1000\nWAIT POS, 0, 0\nSTOP\n")
    return path


def test_the_tools_for_programs(program):
    assert run("asm", program)[0] == 0
    status, text, _ = run("dis", program.with_suffix(".bin"))
    assert (status, " ".join(text.split()).count("MVP ABS, 0, 1000")) == (0, 1)
    assert run("fmt", "--check", program)[0] in {0, 1}
    assert run("lint", program)[0] in {0, 1}
    assert run("run", program)[0] == 0


def framed(message):
    body = json.dumps(message)
    return f"Content-Length: {len(body)}\r\n\r\n{body}"


def test_the_language_server(program):
    text = framed({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"capabilities": {}}})
    text += framed({"jsonrpc": "2.0", "id": 2, "method": "shutdown"}) + framed(
        {"jsonrpc": "2.0", "method": "exit"}
    )
    status, output, _ = run("lsp", text=text)
    assert status == 0
    assert '"capabilities"' in output


def test_the_debug_adapter(program):
    text = framed({"seq": 1, "type": "request", "command": "initialize", "arguments": {"adapterID": "tmcl"}})
    text += framed({"seq": 2, "type": "request", "command": "disconnect"})
    status, output, _ = run("dap", text=text)
    assert (status, '"initialized"' in output or '"initialize"' in output) == (0, True)


def test_a_module_over_tcp_and_an_ide_beside_it():
    with start("serve", "--tcp", "0") as served:
        address = served.stdout.readline().split()[2]
        with start("ide", "--no-browser", "--port", f"tcp://{address}") as ide:
            ide.stdin.close()
            line = ide.stdout.readline()
            ide.terminate()
            assert "hidden" not in ide.stderr.read()
        assert line.startswith("ready ide http://")
        served.terminate()
        assert (served.wait(10), served.stderr.read()) == (0, "")


def test_a_host_over_tcp():
    with start("serve", "--tcp", "0") as served:
        address = served.stdout.readline().split()[2]
        script = (
            f"{HIDE}\nfrom tmcm34x.host import connect\nwith connect('tcp:{address}') as line: print(line)\n"
        )
        result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
        served.terminate()
        served.wait(10)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("options", [("--pty",), ("--slcan",), ()])
def test_terminals_are_refused_in_one_line(options):
    status, _, errors = run("serve", *options)
    assert status == 2
    assert errors.startswith("tmcm34x serve: there are no pseudo terminals on this system")
    assert errors.count("\n") == 1
