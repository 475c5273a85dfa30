"""The VS Code extension folder agrees with the language and the server."""

import importlib.util
import json
import re
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

import msgspec
import pytest

from tmcm34x.board.models import MODELS
from tmcm34x.debug.dap.messages import Attach, Launch
from tmcm34x.editor.disk import DiskFiles
from tmcm34x.editor.language_server import TmclServer
from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.reference import textmate_grammar

FOLDER = Path(__file__).parents[2] / "editors" / "vscode"
PACKAGE = json.loads((FOLDER / "package.json").read_text())
LANGUAGE = json.loads((FOLDER / "language-configuration.json").read_text())
(DEBUGGER,) = PACKAGE["contributes"]["debuggers"]
REQUESTS = {"launch": Launch, "attach": Attach}
OF_THE_EDITOR = {"noDebug"}
"""What an editor adds by itself: nobody writes it into launch.json."""


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


def test_the_settings_are_the_server_s_options():
    properties = PACKAGE["contributes"]["configuration"]["properties"]
    options = {name.removeprefix("tmcl."): value["default"] for name, value in properties.items()}
    assert set(options) == {"command", "model", "includePath", "hints", "rulesOn", "rulesOff"}
    server = TmclServer(DiskFiles())
    assert options["model"] == server.programs.model
    assert set(options["hints"]) == server.hints
    assert options["includePath"] == server.programs.include_path


def attributes(kind):
    """What the adapter takes of a request, as package.json would say it."""
    _, components = msgspec.json.schema_components([kind])
    found = {}
    for name, row in components[kind.__name__]["properties"].items():
        (typed,) = [way for way in row.get("anyOf", [row]) if way["type"] != "null"]
        found[name] = {
            key: typed[key] for key in ("type", "minimum", "maximum", "exclusiveMinimum") if key in typed
        }
        if row.get("default") not in (None, []):
            found[name]["default"] = row["default"]
    return {name: row for name, row in found.items() if name not in OF_THE_EDITOR}


@pytest.mark.parametrize("request_", REQUESTS)
def test_a_launch_configuration_offers_what_the_adapter_takes(request_):
    offered = DEBUGGER["configurationAttributes"][request_]
    rows = {}
    for name, row in offered["properties"].items():
        assert row["description"].endswith(".")
        rows[name] = {key: value for key, value in row.items() if key not in ("description", "enum", "items")}
    assert rows == attributes(REQUESTS[request_])
    assert set(offered["required"]) <= set(rows)


def test_a_launch_configuration_offers_the_models_that_there_are():
    properties = DEBUGGER["configurationAttributes"]["launch"]["properties"]
    settings = PACKAGE["contributes"]["configuration"]["properties"]
    assert properties["model"]["enum"] == settings["tmcl.model"]["enum"] == list(MODELS)


def plain(value):
    """What a snippet leaves in the file when nothing is typed into it."""
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items()}
    if not isinstance(value, str):
        return value
    text = re.sub(r"\$\{\d+\|([^,]*),[^}]*\|\}", r"\1", value)
    text = re.sub(r"\$\{\d+:((?:\\.|[^}\\])*)\}", r"\1", text).replace("\\$", "$").replace("\\}", "}")
    return json.loads(text[1:]) if text.startswith("^") else text


@pytest.mark.parametrize(
    "configuration",
    DEBUGGER["initialConfigurations"] + [plain(row["body"]) for row in DEBUGGER["configurationSnippets"]],
    ids=lambda configuration: configuration["name"],
)
def test_a_configuration_that_is_suggested_is_taken(configuration):
    assert (configuration["type"], configuration["program"]) == (DEBUGGER["type"], "${file}")
    kind = configuration["request"]
    offered = DEBUGGER["configurationAttributes"][kind]
    assert set(offered["required"]) <= configuration.keys()
    assert configuration.keys() - offered["properties"].keys() == {"type", "request", "name"}
    msgspec.convert(configuration, REQUESTS[kind])


def test_words_brackets_and_comments_are_the_language_s():
    word = re.compile(LANGUAGE["wordPattern"])
    assert word.findall("Go: SAP 4,0,$1F+%101*1.5 // 2") == ["Go", "SAP", "4", "0", "$1F", "%101", "1.5", "2"]
    (opening, closing), comment = LANGUAGE["brackets"][0], LANGUAGE["comments"]["lineComment"]
    assert assemble(f"A = {opening}1 + 2{closing} * 3 {comment} {{\n").symbols["A"].value == 9


def test_commands_are_typed_below_commands_and_labels_at_the_margin():
    rules = LANGUAGE["indentationRules"]
    for line in ("Go:", "Go:     STOP", "Go :"):
        assert re.search(rules["increaseIndentPattern"], line)
        assert re.search(rules["decreaseIndentPattern"], "        " + line)
    for line in ("        STOP", "Speed = 5", "// Go: there", "        STOP // Go: there"):
        assert not re.search(rules["increaseIndentPattern"], line)
        assert not re.search(rules["decreaseIndentPattern"], line)


def test_the_package_holds_all_that_it_names(tmp_path):
    spec = importlib.util.spec_from_file_location("pack", FOLDER / "pack.py")
    pack = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(pack)
    file = tmp_path / "new" / "tmcl.vsix"
    pack.pack(file, PACKAGE, "the script")
    with ZipFile(file) as archive:
        assert archive.read("extension/extension.js") == b"the script"
        assert json.loads(archive.read("extension/package.json")) == PACKAGE
        names = set(archive.namelist())
        contributes = PACKAGE["contributes"]
        for path in (contributes["languages"][0]["configuration"], contributes["grammars"][0]["path"]):
            assert f"extension/{path.removeprefix('./')}" in names
        manifest = ElementTree.fromstring(archive.read("extension.vsixmanifest"))
        types = ElementTree.fromstring(archive.read("[Content_Types].xml"))
    space = {"": manifest.tag[1 : manifest.tag.index("}")]}
    identity = manifest.find("./Metadata/Identity", space).attrib
    assert (identity["Id"], identity["Publisher"]) == (PACKAGE["name"], PACKAGE["publisher"])
    assert identity["Version"] == PACKAGE["version"]
    assert {asset.attrib["Path"] for asset in manifest.iterfind(".//Asset", space)} <= names
    known = {row.attrib["Extension"] for row in types}
    assert {Path(name).suffix for name in names if name != "[Content_Types].xml"} == known
