"""`--user-functions`: a customer's extension in a Python file."""

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tmcm34x.tmcl.datagram import pack_request, unpack_reply
from tmcm34x.tmcl.mnemonic import parse_instruction

COMMAND = str(Path(sys.executable).with_name("tmcm34x"))
EXTENSION = """
BANK_1 = {3: 40}

def uf0(module, type, motor, value):
    return type + motor + value

def uf1(module, type, motor, value):
    return 42, value * 2

def uf2(module, type, motor, value):
    module.user_parameters[3] += value

def uf3(module, type, motor, value):
    return 1 // value
"""


@pytest.fixture
def extension(tmp_path):
    path = tmp_path / "extension.py"
    path.write_text(EXTENSION)
    return path


def ask(address, text):
    host, _, port = address.rpartition(":")
    with socket.create_connection((host, int(port)), timeout=60) as connection:
        connection.sendall(pack_request(1, parse_instruction(text)))
        reply = unpack_reply(connection.recv(9, socket.MSG_WAITALL))
    return reply.status, reply.value


def tmcm34x(*arguments):
    return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False)


def test_serve_answers_with_the_functions_of_the_file(serve, extension):
    address = serve("--tcp", 0, "--user-functions", extension).tcp
    assert ask(address, "UF0 1, 2, 30") == (100, 33)
    assert ask(address, "UF1 0, 0, -21") == (42, -42)
    assert ask(address, "UF2 0, 0, 2") == (100, 2)
    assert ask(address, "GGP 3, 1") == (100, 42)
    assert ask(address, "UF7") == (6, 0)


def test_a_function_that_fails_is_told_with_its_line_and_answered_with_status_6(tmp_path, extension):
    program = tmp_path / "program.tmc"
    program.write_text("UF3 0, 0, 0\nUF0 1, 2, 3\nAGP 0, 2\nSTOP\n")
    result = tmcm34x("run", program, "--user-functions", extension, "--json")
    assert (
        result.stderr
        == f"tmcm34x run: {extension}:14: uf3: ZeroDivisionError: integer division or modulo by zero\n"
    )
    assert '"0": 6' in result.stdout
    assert result.returncode == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def uf0(:\n", ":1: SyntaxError: "),
        ("\nimport no_such_module\n", ":2: ModuleNotFoundError: "),
        ("x = 1\n", ": defines none of uf0 to uf7 and no BANK_1"),
        ("BANK_1 = {300: 1}\n", ": BANK_1 is a dictionary from numbers 0 to 255 to whole numbers"),
        (None, ": No such file or directory"),
    ],
)
def test_a_file_of_no_use_is_refused_with_one_line(tmp_path, text, message):
    path = tmp_path / "extension.py"
    if text is not None:
        path.write_text(text)
    result = tmcm34x("serve", "--user-functions", path)
    assert result.returncode == 2
    assert f"{path}{message}" in result.stderr
    assert result.stderr.count("\n") == 1
