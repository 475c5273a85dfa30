"""`tmcm34x asm`, `dis`, `fmt` and `lint` on real files."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from tmcm34x.cli import group
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.image import pack_binary, unpack_binary, unpack_hex

GOOD = "Speed = 500                     // fast\nLoop:   ROR   0, Speed\n        JA    Loop\n        STOP\n"
IMAGE = pack_binary([Instruction(1, 0, 0, 500), Instruction(22), Instruction(28)])


@pytest.fixture
def call(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments):
        result = CliRunner().invoke(group, [str(a) for a in arguments], standalone_mode=False)
        if result.exception is not None and not hasattr(result.exception, "exit_code"):
            raise result.exception
        status = getattr(result.exception, "exit_code", result.return_value or 0)
        message = result.exception.format_message() if result.exception is not None else ""
        return status, result.stdout, result.stderr + message

    return invoke


def put(name, text):
    path = Path(name)
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_asm_writes_the_image_beside_the_source(call):
    status, out, err = call("asm", put("go.tmc", GOOD))
    assert (status, err) == (0, "")
    assert out == "go.bin: 3 instructions\n"
    assert Path("go.bin").read_bytes() == IMAGE


def test_asm_writes_intel_hex_by_the_suffix(call):
    assert call("asm", put("go.tmc", GOOD), "-o", "out.hex")[0] == 0
    assert unpack_hex(Path("out.hex").read_text()) == unpack_binary(IMAGE)


def test_asm_tells_every_mistake_with_its_line_and_a_caret(call):
    status, out, err = call("asm", put("bad.tmc", "ROR 0, 0x10\n\tMPV ABS, 0, 1\r\nVECT 1"))
    assert (status, out) == (1, "")
    assert err == (
        "bad.tmc:1:8: error[E102]: 0x10 is not a number; hexadecimal numbers are written $10\n"
        "  ROR 0, 0x10\n         ^~~~\n"
        "bad.tmc:2:2: error[E201]: no command MPV; did you mean MVP?\n"
        "   MPV ABS, 0, 1\n   ^~~\n"
        "bad.tmc:3:1: error[E202]: VECT (command 37) is of other TMCL firmware: "
        "modules with interrupts (TMCM-1110 and newer); "
        "a TMCM-34x has JC with the error flags, and loops that read inputs\n"
        "  VECT 1\n  ^~~~\n"
    )
    assert not Path("bad.bin").exists()


def test_asm_finds_includes_beside_the_file_and_on_the_path(call):
    Path("sub").mkdir()
    Path("lib").mkdir()
    put("lib/names.inc", "Top = 700\n")
    put("sub/near.inc", "#include names.inc\nROR 0, Top\n")
    main = put("sub/main.tmc", "#include near.inc\n")
    assert call("asm", main, "-I", "lib", "-o", "x.bin")[0] == 0
    assert unpack_binary(Path("x.bin").read_bytes()) == (Instruction(1, 0, 0, 700), Instruction(28))
    status, _, err = call("asm", main)
    assert status == 1
    assert "sub/near.inc:1:10: error[E501]: cannot read names.inc" in err


def test_asm_refuses_files_that_include_themselves_by_another_way(call):
    Path("sub").mkdir()
    status, _, err = call("asm", put("a.tmc", "#include sub/../a.tmc\nSTOP"))
    assert status == 1
    assert "E502" in err


def test_asm_appends_stop_unless_told_otherwise(call):
    assert (
        call("asm", put("go.tmc", "ROR 0, 5"))[1] == "go.bin: 2 instructions, the last one an appended STOP\n"
    )
    assert unpack_binary(Path("go.bin").read_bytes())[-1] == Instruction(28)
    assert call("asm", "go.tmc", "--no-append-stop")[1] == "go.bin: 1 instruction\n"
    assert call("lint", "go.tmc")[0] == 0
    assert "W102" in call("lint", "go.tmc", "--no-append-stop")[2]


def test_asm_knows_the_model(call):
    put("go.tmc", "SAP 6, 0, 100")
    assert call("asm", "go.tmc") == (0, "go.bin: 2 instructions, the last one an appended STOP\n", "")
    status, _, err = call("asm", "go.tmc", "--model", "342")
    assert status == 0
    assert "go.tmc:1:5: warning[W302]" in err


def test_a_symbol_file_names_labels_and_constants(call):
    call("asm", put("go.tmc", GOOD), "--symbols", "go.sym")
    assert Path("go.sym").read_text() == "constant\tSpeed\t500\tgo.tmc:1\nlabel\tLoop\t0\tgo.tmc:2\n"


def test_a_listing_shows_addresses_and_bytes_beside_the_source(call):
    put("names.inc", "Sub: RSUB\n")
    call("asm", put("go.tmc", f"{GOOD}#include names.inc\n#include names.inc\n"), "--listing", "go.lst")
    assert Path("go.lst").read_text() == (
        "address  image                    line  source\n"
        "                                     1  Speed = 500                     // fast\n"
        "0000     01 00 00 00 00 01 f4 f6     2  Loop:   ROR   0, Speed\n"
        "0001     16 00 00 00 00 00 00 16     3          JA    Loop\n"
        "0002     1c 00 00 00 00 00 00 1c     4          STOP\n"
        "                                     5  #include names.inc\n"
        "0003     18 00 00 00 00 00 00 18     1  Sub: RSUB\n"
        "                                     6  #include names.inc\n"
        "0004     1c 00 00 00 00 00 00 1c        STOP // appended: the program did not end with one\n"
    )


@pytest.mark.parametrize(
    "arguments",
    [("asm", "none.tmc"), ("asm", "."), ("dis", "none.bin"), ("fmt", "none.tmc"), ("lint", "none.tmc"), ("asm",),
     ("asm", "go.bin"), ("asm", "go.tmc", "--model", "140"), ("dis", "go.tmc"), ("dis", "go.hex"), ("fmt",),
     ("asm", "go.tmc", "-o", "no/where.bin")],
)  # fmt: skip
def test_wrong_files_and_options_give_status_2(call, arguments):
    put("go.tmc", "STOP")
    put("go.bin", "STOP")
    put("go.hex", "STOP")
    status, out, err = call(*arguments)
    assert (status, out) == (2, "")
    assert len(err.strip().splitlines()) == 1


def test_asm_never_overwrites_its_source(call):
    put("go.bin", "STOP")
    assert call("asm", "go.bin", "-o", "./go.bin")[0] == 2
    assert Path("go.bin").read_text() == "STOP"


def test_dis_writes_source_that_assembles_to_the_image(call):
    put("go.bin", IMAGE + pack_binary([Instruction(37, 1, 2, 3), Instruction(0)]))
    status, out, err = call("dis", "go.bin")
    assert (status, err) == (0, "")
    assert out.splitlines()[:2] == ["L0:     ROR   0, 500", "        JA    L0"]
    assert call("dis", "go.bin", "-o", "back.tmc")[:2] == (0, "")
    call("asm", "back.tmc", "-o", "again.bin", "--no-append-stop")
    assert Path("again.bin").read_bytes() == Path("go.bin").read_bytes()
    assert "DATA 0," not in call("dis", "go.bin", "--end-mark")[1]


def test_dis_takes_names_from_an_older_source(call):
    call("asm", put("go.tmc", GOOD))
    status, out, err = call("dis", "go.bin", "--like", "go.tmc")
    assert (status, err) == (0, "")
    assert out == GOOD.replace("500                     //", "500                     //")
    assert call("dis", "go.bin", "--like", put("bad.tmc", "foo 1"))[0] == 1


def test_an_older_source_is_read_for_the_module_that_the_image_is_for(call):
    source = "#if MODEL == 342\nStart:  MST   2\n#else\nOther:  MST   0\n#endif\n        JA    Start\n"
    put("old.tmc", source)
    put("go.bin", pack_binary([Instruction(3, 0, 2), Instruction(22)]))
    assert call("dis", "go.bin", "--like", "old.tmc", "--model", "342")[1].startswith("Start:  MST   2")
    assert call("dis", "go.bin", "--like", "old.tmc")[0] == 1


def test_commands_of_sister_firmware_are_named(call):
    put("go.bin", pack_binary([Instruction(37, 1, 2, 3), Instruction(28)]))
    assert "//! DATA 37, 1, 2, 3" in call("dis", "go.bin")[1]
    assert "// VECT of other firmware" in call("dis", "go.bin")[1]
    call("dis", "go.bin", "-o", "back.tmc")
    call("asm", "back.tmc", "-o", "again.bin")
    assert Path("again.bin").read_bytes() == Path("go.bin").read_bytes()


def test_dis_refuses_a_damaged_image_with_the_offset(call):
    put("go.bin", IMAGE[:-3])
    status, _, err = call("dis", "go.bin")
    assert status == 2
    assert "go.bin: offset 16: truncated" in err


def test_fmt_writes_only_what_changes(call):
    put("tidy.tmc", GOOD)
    put("wild.tmc", "loop:ror 0,1//x\nja loop")
    assert call("fmt", "--check", "tidy.tmc", "wild.tmc")[0] == 1
    assert Path("wild.tmc").read_text() == "loop:ror 0,1//x\nja loop"
    status, out, _ = call("fmt", "tidy.tmc", "wild.tmc")
    assert (status, out) == (0, "wild.tmc: formatted\n")
    assert call("fmt", "--check", "tidy.tmc", "wild.tmc") == (0, "", "")


@pytest.mark.parametrize(
    ("codec", "mark"),
    [("utf-8", b""), ("utf-8", b"\xef\xbb\xbf"), ("utf-16-le", b"\xff\xfe"), ("utf-16-be", b"\xfe\xff"),
     ("cp1252", b"")],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_fmt_keeps_encoding_byte_order_mark_and_line_ends(call, codec, mark, end):
    put("old.tmc", mark + f"stop // “größer”™{end}//{end}".encode(codec))
    assert call("fmt", "old.tmc")[0] == 0
    expected = f"        STOP                    // “größer”™{end}//{end}"
    assert Path("old.tmc").read_bytes() == mark + expected.encode(codec)


@pytest.mark.parametrize(
    "data",
    [IMAGE, b"\xff\xfeS\0T\0\0", "stop\n".encode("utf-16-le"), b"stop\n\x00", b"stop ; note\n", b"sap 4, 0, 1a\n",
     bytes(range(256))],
)  # fmt: skip
def test_fmt_leaves_what_is_no_tmcl(call, data):
    status, out, err = call("fmt", put("p.tmc", data))
    assert (out, len(err.strip().splitlines())) == ("", 1)
    assert status in (1, 2)
    assert Path("p.tmc").read_bytes() == data


def test_utf_16_is_read_as_what_it_is(call):
    assert call("asm", put("go.tmc", b"\xff\xfe" + GOOD.encode("utf-16-le")))[0] == 0
    assert Path("go.bin").read_bytes() == IMAGE
    status, _, err = call("lint", put("raw.tmc", GOOD.encode("utf-16-le")))
    assert (status, err.partition(": ")[2]) == (
        2, "raw.tmc: UTF-16 without a byte order mark; save it as UTF-8\n",
    )  # fmt: skip
    put("sub.inc", GOOD.encode("utf-16-be"))
    status, _, err = call("lint", put("main.tmc", "#include sub.inc\nSTOP\n"))
    assert err.count("E501") == 1


def test_lint_tells_findings_with_status_1(call):
    put("go.tmc", "ROR 5, 1\nSTOP")
    status, out, err = call("lint", "go.tmc")
    assert (status, out) == (1, "")
    assert err.startswith("go.tmc:1:5: warning[W303]: no motor 5")
    put("fine.tmc", GOOD)
    assert call("lint", "fine.tmc") == (0, "", "")
    put("info.tmc", "Unused = 5\nSTOP")
    status, _, err = call("lint", "info.tmc", "fine.tmc")
    assert status == 0
    assert "information[W401]" in err


def test_an_include_file_is_linted_as_a_part_of_its_program(call):
    put("main.tmc", "X = 1\nCSUB Sub\nSTOP\n#include SUB.inc\nROR 5, X\n")
    put("sub.inc", "Sub: ROR 0, X\nRSUB\n")
    assert call("lint", "sub.inc") == (0, "", "")
    put("sub.inc", "Sub: ROR 0, X\nROR 7, 1\nRSUB\n")
    status, _, err = call("lint", "sub.inc")
    assert (status, err.count("[W")) == (1, 1)
    assert err.startswith("sub.inc:2:5: warning[W303]")


def test_asm_writes_one_plain_source(call):
    put("names.inc", "Speed = 7\n")
    put(
        "go.tmc",
        "#include names.inc\n#if MODEL == 342\nROR 0, Speed\n#else\nROL 0, Speed\n#endif\nGo:\n.x: JA .x\n",
    )
    assert call("asm", "go.tmc", "--emit-tmcl", "plain.tmc", "--model", "342")[0] == 0
    assert Path("plain.tmc").read_text() == (
        "// from names.inc\nSpeed = 7\n        ROR   0, Speed\nGo:\nGo_x:   JA    Go_x\n"
    )
    assert call("asm", "plain.tmc")[0] == 0
    assert Path("plain.bin").read_bytes() == Path("go.bin").read_bytes()


def test_lint_explains_a_code(call):
    status, out, err = call("lint", "--explain", "w502")
    assert (status, err) == (0, "")
    assert out.startswith("W502: a value that is read and lost\n")
    assert "CALCX LOAD" in out
    assert call("lint", "--explain", "E205")[1].startswith(
        "E205: an operand that must be one of certain words"
    )
    status, _, err = call("lint", "--explain", "W999")
    assert (status, len(err.splitlines())) == (2, 1)


def test_rules_are_switched_on_and_off(call):
    put("go.tmc", "ROR 5, 1\nL: GIO 0, 0\nJC ZE, L\nSTOP")
    assert "W206" in call("lint", "go.tmc", "--on", "W206", "--off", "w303")[2]
    assert call("lint", "go.tmc", "--off", "W303") == (0, "", "")
    assert call("lint", "go.tmc", "--off", "W999")[0] == 2


def test_folders_stand_for_their_sources(call):
    for name in ("a", "a/b", "c"):
        Path(name).mkdir()
    put("a/one.tmc", "ror 9, 1\nstop")
    put("a/b/two.tmc", "ror 8, 1\nstop")
    put("a/readme.md", "no source")
    err = call("lint", "a")[2]
    assert [line.partition(":")[0] for line in err.splitlines() if "[W" in line] == [
        "a/b/two.tmc",
        "a/one.tmc",
    ]
    assert call("fmt", "a")[1] == "a/b/two.tmc: formatted\na/one.tmc: formatted\n"
    assert call("lint", "c")[0] == call("fmt", "c")[0] == 2


def test_a_file_that_holds_no_text_does_not_keep_a_folder_from_being_treated(call):
    Path("a").mkdir()
    Path("a/one.tmc").write_bytes(b"\xff\xfeS")
    put("a/two.tmc", "stop\n")
    status, output, err = call("fmt", "a")
    assert (status, output) == (2, "a/two.tmc: formatted\n")
    assert "fmt: a/one.tmc: not UTF-16-LE at byte 2" in err
    assert call("lint", "a")[0] == 2


def test_a_finding_in_a_file_of_several_programs_is_printed_once(call):
    Path("a").mkdir()
    put("a/sub.tmc", "Sub: SAP 8, 0, 1\nRSUB\n")
    for name in ("one", "two"):
        put(f"a/{name}.tmc", "CSUB Sub\nSTOP\n#include sub.tmc\n")
    status, _, err = call("lint", "a")
    assert (status, err.count("warning[W304]")) == (1, 1)


def test_a_dash_is_standard_input(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)

    def pipe(text, *arguments):
        return CliRunner().invoke(group, arguments, input=text)

    assert pipe("ror 0,1\r\n", "fmt", "-").stdout_bytes == b"        ROR   0, 1\r\n"
    assert pipe("ROR 9, 1\nSTOP", "lint", "-").stderr.startswith("standard input:1:5: warning[W303]")
    assert pipe("ROR 0, 1\nSTOP", "asm", "-", "-o", "x.bin").exit_code == 0
    assert Path("x.bin").stat().st_size == 16
    assert "ROR   0, 1" in pipe(Path("x.bin").read_bytes(), "dis", "-").stdout
    assert pipe("STOP", "asm", "-").exit_code == 2
    assert pipe("STOP", "asm", "-", "-o", "-").stdout_bytes == bytes.fromhex("1c 00 00 00 00 00 00 1c")


def test_rubbish_is_never_a_traceback(call):
    rubbish = [
        bytes(range(256)) * 40,
        b"\0" * 1000,
        "\ufeffSTOP".encode("utf-16-le"),
        b"(" * 1_000_000,
        b"A" * 1_000_000,
        b"\r" * 1000,
        b"ROR 0, " + b"9" * 1_000_000,
        b" " * 1_000_000 + b"STOP",
        b"#include \0\nSTOP",
        b"#include ..\n",
    ]
    for number, data in enumerate(rubbish):
        put("x.tmc", data)
        for name in ("asm", "lint", "fmt"):
            status, _, err = call(name, "x.tmc")
            assert status in (0, 1, 2), number
            assert status < 2 or len(err.splitlines()) == 1, number
            assert max(map(len, err.splitlines()), default=0) < 400, number
