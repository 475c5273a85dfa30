from __future__ import annotations

import codecs
import os

import pytest

from tmcm34x.ide.wire import RefusalError
from tmcm34x.ide.workspace import MAX_BYTES, OVERWRITE, OpenFolder


def _code(action, *arguments) -> str:
    with pytest.raises(RefusalError) as refused:
        action(*arguments)
    return refused.value.code


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    (tmp_path / "secret.tmc").write_text("STOP\n")
    return OpenFolder(folder)


@pytest.mark.parametrize(
    "path", ["", "/etc/passwd", "../secret.tmc", "a/../../secret.tmc", "a\0b.tmc", ".", "a/.."]
)
def test_no_path_leads_out_of_the_folder(workspace, path):
    assert _code(workspace.read, path) == "path"
    assert _code(workspace.write, path, "x", "", "\n") == "path"
    assert _code(workspace.delete, path) == "path"
    assert _code(workspace.rename, path, "b.tmc") == "path"


def test_a_symbolic_link_out_of_the_folder_is_not_followed(workspace):
    (workspace.folder / "link.tmc").symlink_to(workspace.folder.parent / "secret.tmc")
    (workspace.folder / "up").symlink_to(workspace.folder.parent)
    assert _code(workspace.read, "link.tmc") == "path"
    assert _code(workspace.write, "link.tmc", "x", "*", "\n") == "path"
    assert _code(workspace.read, "up/secret.tmc") == "path"
    assert [entry.path for entry in workspace.files()] == ["link.tmc"]


def test_nothing_leads_out_behind_links_in_a_circle(workspace):
    """The name `circle/../up` is not looked up by the system, and must not become `up` unseen."""
    (workspace.folder / "circle.tmc").symlink_to("circle.tmc")
    (workspace.folder / "into.tmc").symlink_to("circle.tmc")
    (workspace.folder / "behind.tmc").symlink_to("circle.tmc/../up/secret.tmc")
    (workspace.folder / "up").symlink_to("..")
    for path in (
        "circle.tmc", "into.tmc", "circle.tmc/a.tmc", "behind.tmc", "circle.tmc/../up/secret.tmc",
        "new/../circle.tmc/../up/secret.tmc",
    ):  # fmt: skip
        assert _code(workspace.read, path) == "path"
        assert _code(workspace.write, path, "x", "*", "\n") == "path"
        assert _code(workspace.delete, path) == "path"
        assert _code(workspace.rename, path, "b.tmc") == "path"
        assert _code(workspace.rename, "b.tmc", path) == "path"
        assert workspace.names(path) == []
    assert workspace.names("circle.tmc/../up") == workspace.names("a\0b") == workspace.names("x" * 300) == []
    assert (workspace.folder.parent / "secret.tmc").read_text() == "STOP\n"


def test_a_text_comes_back_as_it_was_saved(workspace):
    entry = workspace.write("sub/a.tmc", "ROR 0, 1\nSTOP\n", "", "\r\n")
    assert (workspace.folder / "sub/a.tmc").read_bytes() == b"ROR 0, 1\r\nSTOP\r\n"
    file = workspace.read("sub/a.tmc")
    assert (file.text, file.newline, file.stamp) == ("ROR 0, 1\nSTOP\n", "\r\n", entry.stamp)


_STORED = {
    "windows-1252": "// größer, “quoted”™\r\n".encode("cp1252"),
    "utf-8 with a mark": b"\xef\xbb\xbf// gr\xc3\xb6\xc3\x9fer\n",
    "utf-8": "// größer → Ω\n".encode(),
    "utf-16-le": codecs.BOM_UTF16_LE + "// größer → Ω\r\n".encode("utf-16-le"),
    "utf-16-be": codecs.BOM_UTF16_BE + "// größer → Ω\n".encode("utf-16-be"),
}


@pytest.mark.parametrize("data", _STORED.values(), ids=_STORED.keys())
def test_a_file_is_saved_in_the_encoding_in_which_it_was(workspace, data):
    (workspace.folder / "old.tmc").write_bytes(data)
    file = workspace.read("old.tmc")
    assert file.text.startswith("// größer")
    entry = workspace.write("old.tmc", file.text, file.stamp, file.newline)
    assert (workspace.folder / "old.tmc").read_bytes() == data
    workspace.write("old.tmc", file.text + "STOP\n", entry.stamp, file.newline)
    assert (workspace.folder / "old.tmc").read_bytes()[: len(data)] == data
    assert workspace.read("old.tmc").text == file.text + "STOP\n"


def test_a_character_that_the_encoding_lacks_is_named_and_not_saved(workspace):
    (workspace.folder / "old.tmc").write_bytes("// größer\n".encode("cp1252"))
    file = workspace.read("old.tmc")
    with pytest.raises(RefusalError, match="'→' is not in windows-1252") as refused:
        workspace.write("old.tmc", file.text + "// →\n", file.stamp, file.newline)
    assert refused.value.code == "encoding"
    assert "UTF-8" in str(refused.value)
    assert (workspace.folder / "old.tmc").read_bytes() == "// größer\n".encode("cp1252")


@pytest.mark.parametrize("text", ["// \ud800\n", "ROR\0"])
def test_what_is_no_text_is_not_saved(workspace, text):
    assert _code(workspace.write, "new.tmc", text, "", "\n") == "encoding"
    assert workspace.files() == []


@pytest.mark.parametrize(
    ("data", "why"),
    [
        ("STOP\n".encode("utf-16-le"), "UTF-16 without"),
        (b"\xef\xbb\xbf\xff", "not UTF-8 at byte 3"),
        (b"ROR\0", "zero"),
    ],
)
def test_a_file_that_is_no_text_is_not_opened(workspace, data, why):
    (workspace.folder / "a.tmc").write_bytes(data)
    with pytest.raises(RefusalError, match=why) as refused:
        workspace.read("a.tmc")
    assert refused.value.code == "kind"


def test_a_file_that_changed_meanwhile_is_not_overwritten(workspace):
    first = workspace.write("a.tmc", "one", "", "\n")
    (workspace.folder / "a.tmc").write_text("from outside, longer")
    assert _code(workspace.write, "a.tmc", "two", first.stamp, "\n") == "changed"
    assert _code(workspace.write, "a.tmc", "two", "", "\n") == "changed"
    workspace.write("a.tmc", "two", "*", "\n")
    assert workspace.read("a.tmc").text == "two"


def test_a_file_deleted_meanwhile_is_saved_again_only_when_asked(workspace):
    entry = workspace.write("a.tmc", "one", "", "\n")
    workspace.delete("a.tmc")
    assert _code(workspace.write, "a.tmc", "two", entry.stamp, "\n") == "changed"
    workspace.write("a.tmc", "two", "*", "\n")


def test_saving_keeps_the_permissions_and_leaves_nothing_behind(workspace):
    workspace.write("a.tmc", "one", "", "\n")
    (workspace.folder / "a.tmc").chmod(0o640)
    workspace.write("a.tmc", "two", "*", "\n")
    assert (workspace.folder / "a.tmc").stat().st_mode & 0o777 == 0o640
    assert [path.name for path in workspace.folder.iterdir()] == ["a.tmc"]


def test_only_texts_are_shown_and_opened(workspace):
    (workspace.folder / "image.bin").write_bytes(b"\0\1")
    (workspace.folder / "zero.tmc").write_bytes(b"ROR\0")
    (workspace.folder / ".hidden.tmc").write_text("x")
    (workspace.folder / "sub" / "empty").mkdir(parents=True)
    (workspace.folder / "node_modules").mkdir()
    (workspace.folder / "node_modules" / "a.md").write_text("x")
    assert [entry.path for entry in workspace.files()] == ["zero.tmc"]
    assert _code(workspace.read, "zero.tmc") == "kind"
    assert _code(workspace.read, "sub") == "kind"
    assert _code(workspace.read, "missing.tmc") == "file"
    assert _code(workspace.write, "program.exe", "x", "", "\n") == "kind"
    assert _code(workspace.rename, "zero.tmc", "zero.exe") == "kind"


def test_a_file_beyond_all_measure_is_refused(workspace):
    (workspace.folder / "big.tmc").write_bytes(b" " * (MAX_BYTES + 1))
    assert _code(workspace.read, "big.tmc") == "size"
    assert _code(workspace.write, "b.tmc", " " * (MAX_BYTES + 1), "", "\n") == "size"


def test_a_file_moves_but_not_onto_another(workspace):
    workspace.write("a.tmc", "a", "", "\n")
    workspace.write("b.tmc", "b", "", "\n")
    assert _code(workspace.rename, "a.tmc", "b.tmc") == "exists"
    workspace.rename("a.tmc", "sub/c.tmc")
    assert [entry.path for entry in workspace.files()] == ["b.tmc", "sub", "sub/c.tmc"]


def test_named_files_open_their_common_folder(tmp_path):
    for name in ("x/a.tmc", "x/y/b.tmc"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("STOP\n")
    workspace, shown = OpenFolder.of([tmp_path / "x/a.tmc", tmp_path / "x/y/b.tmc"])
    assert workspace.folder == (tmp_path / "x").resolve()
    assert shown == ["a.tmc", "y/b.tmc"]
    assert OpenFolder.of([tmp_path / "x"])[1] == []


def test_a_file_named_by_the_user_is_shown_and_saved_whatever_its_name_ends_in(tmp_path):
    (tmp_path / "old.asm").write_text("STOP\n")
    workspace, show = OpenFolder.of([tmp_path / "old.asm"])
    assert show == ["old.asm"]
    assert [entry.path for entry in workspace.files()] == ["old.asm"]
    workspace.write("old.asm", "STOP // kept\n", workspace.read("old.asm").stamp, "\n")
    assert (tmp_path / "old.asm").read_text() == "STOP // kept\n"


def test_a_pipe_or_a_folder_is_not_written_to(tmp_path):
    os.mkfifo(tmp_path / "pipe.tmc")
    (tmp_path / "folder.tmc").mkdir()
    workspace = OpenFolder(tmp_path)
    for name in ("pipe.tmc", "folder.tmc"):
        with pytest.raises(RefusalError) as error:
            workspace.write(name, "STOP\n", OVERWRITE, "\n")
        assert (error.value.code, str(error.value)) == ("kind", f"{name} is not a file.")
