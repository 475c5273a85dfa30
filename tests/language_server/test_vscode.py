"""The VS Code extension folder agrees with the language and the server."""

import json
import re
from pathlib import Path

from tmcm34x.language_server import TmclServer
from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.reference import textmate_grammar

FOLDER = Path(__file__).parents[2] / "editors" / "vscode"
PACKAGE = json.loads((FOLDER / "package.json").read_text())


def scope(line, word):
    """The scope that the grammar gives to a word of a line: its patterns in turn, from left to right."""
    position = 0
    while position < len(line):
        found = [
            (match.start(), number, match, pattern["name"])
            for number, pattern in enumerate(textmate_grammar()["patterns"])
            if (match := re.compile(pattern["match"]).search(line, position))
        ]
        if not found:
            return None
        _, _, match, name = min(found, key=lambda item: item[:2])
        if word in match.group():
            return name
        position = max(match.end(), position + 1)
    return None


def test_the_grammar_file_is_fresh():
    assert json.loads((FOLDER / "syntaxes" / "tmcl.tmLanguage.json").read_text()) == textmate_grammar()


def test_the_grammar_knows_every_word():
    for row in COMMANDS:
        assert scope(f"  {row.mnemonic.lower()} 1", row.mnemonic.lower()) == "keyword.control.tmcl"
    for name in FUNCTIONS:
        assert scope(f"X = {name}(1)", name) == "support.function.tmcl"
    for line, word, expected in (
        ("Loop: MVP ABS, 0, 5", "Loop", "entity.name.function.label.tmcl"),
        ("Loop: MVP ABS, 0, 5", "ABS", "constant.language.tmcl"),
        ("Speed = $1F // x", "Speed", "variable.other.constant.tmcl"),
        ("Speed = $1F // x", "$1F", "constant.numeric.tmcl"),
        ("Speed = $1F // MVP", "MVP", "comment.line.double-slash.tmcl"),
        ("//! DATA 1, 2, 3, 4", "DATA", "keyword.other.directive.tmcl"),
        ("#include a.inc", "#include", "keyword.control.directive.tmcl"),
    ):
        assert scope(line, word) == expected


def test_files_that_the_package_names_exist():
    contributes = PACKAGE["contributes"]
    for path in (
        PACKAGE["main"],
        contributes["languages"][0]["configuration"],
        contributes["grammars"][0]["path"],
    ):
        assert (FOLDER / path).is_file()
    json.loads((FOLDER / "language-configuration.json").read_text())


def test_the_settings_are_the_server_s_options():
    properties = PACKAGE["contributes"]["configuration"]["properties"]
    options = {name.removeprefix("tmcl."): value["default"] for name, value in properties.items()}
    assert set(options) == {"command", "model", "includePath", "hints"}
    server = TmclServer(lambda name: "")
    assert options["model"] == server.programs.model
    assert set(options["hints"]) == server.hints
    assert options["includePath"] == server.programs.include_path
