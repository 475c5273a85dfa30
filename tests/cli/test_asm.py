"""`tmcm34x asm`, `dis`, `fmt` and `lint` on real files."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from tmcm34x.cli import group
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.image import pack_binary, unpack_binary, unpack_hex

GOOD = "Speed = 500                     // fast\nLoop:   ROR   0, Speed\n        JA    Loop\n        STOP\n"
IMAGE = pack_binary([Instruction(1, 0, 0, 500), Instruction(22), Instruction(28)])


def put(name, text):
    path = Path(name)
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_asm_writes_the_image_beside_the_source(invoke):
    status, out, err = invoke("asm", put("go.tmc", GOOD))
    assert (status, err) == (0, "")
    assert out == "go.bin: 3 instructions\n"
    assert Path("go.bin").read_bytes() == IMAGE


def test_asm_writes_intel_hex_by_the_suffix(invoke):
    assert invoke("asm", put("go.tmc", GOOD), "-o", "out.hex")[0] == 0
    assert unpack_hex(Path("out.hex").read_text()) == unpack_binary(IMAGE)


def test_asm_tells_every_mistake_with_its_line_and_a_caret(invoke):
    status, out, err = invoke("asm", put("bad.tmc", "ROR 0, 0x10\n\tMPV ABS, 0, 1\r\nVECT 1"))
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


def test_asm_finds_includes_beside_the_file_and_on_the_path(invoke):
    Path("sub").mkdir()
    Path("lib").mkdir()
    put("lib/names.inc", "Top = 700\n")
    put("sub/near.inc", "#include names.inc\nROR 0, Top\n")
    main = put("sub/main.tmc", "#include near.inc\n")
    assert invoke("asm", main, "-I", "lib", "-o", "x.bin")[0] == 0
    assert unpack_binary(Path("x.bin").read_bytes()) == (Instruction(1, 0, 0, 700), Instruction(28))
    status, _, err = invoke("asm", main)
    assert status == 1
    assert "sub/near.inc:1:10: error[E501]: cannot read names.inc" in err


def test_asm_refuses_files_that_include_themselves_by_another_way(invoke):
    Path("sub").mkdir()
    status, _, err = invoke("asm", put("a.tmc", "#include sub/../a.tmc\nSTOP"))
    assert status == 1
    assert "E502" in err


def test_asm_appends_stop_unless_told_otherwise(invoke):
    assert (
        invoke("asm", put("go.tmc", "ROR 0, 5"))[1]
        == "go.bin: 2 instructions, the last one an appended STOP\n"
    )
    assert unpack_binary(Path("go.bin").read_bytes())[-1] == Instruction(28)
    assert invoke("asm", "go.tmc", "--no-append-stop")[1] == "go.bin: 1 instruction\n"
    assert invoke("lint", "go.tmc")[0] == 0
    assert "W102" in invoke("lint", "go.tmc", "--no-append-stop")[2]


def test_asm_knows_the_model(invoke):
    put("go.tmc", "SAP 6, 0, 100")
    assert invoke("asm", "go.tmc") == (0, "go.bin: 2 instructions, the last one an appended STOP\n", "")
    status, _, err = invoke("asm", "go.tmc", "--model", "342")
    assert status == 0
    assert "go.tmc:1:5: warning[W302]" in err


def test_a_symbol_file_names_labels_and_constants(invoke):
    invoke("asm", put("go.tmc", GOOD), "--symbols", "go.sym")
    assert Path("go.sym").read_text() == "constant\tSpeed\t500\tgo.tmc:1\nlabel\tLoop\t0\tgo.tmc:2\n"


def test_a_listing_shows_addresses_and_bytes_beside_the_source(invoke):
    put("names.inc", "Sub: RSUB\n")
    invoke("asm", put("go.tmc", f"{GOOD}#include names.inc\n#include names.inc\n"), "--listing", "go.lst")
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
def test_wrong_files_and_options_give_status_2(invoke, arguments):
    put("go.tmc", "STOP")
    put("go.bin", "STOP")
    put("go.hex", "STOP")
    status, out, err = invoke(*arguments)
    assert (status, out) == (2, "")
    assert len(err.strip().splitlines()) == 1


def test_asm_never_overwrites_its_source(invoke):
    put("go.bin", "STOP")
    assert invoke("asm", "go.bin", "-o", "./go.bin")[0] == 2
    assert Path("go.bin").read_text() == "STOP"


def test_the_image_that_no_option_names_is_no_other_output(invoke):
    put("go.tmc", "STOP")
    status, out, err = invoke("asm", "go.tmc", "--listing", "go.bin")
    assert (status, out) == (2, "")
    assert (
        err.strip() == "go.bin is both --listing and -o / --output: what is written needs a file of its own"
    )
    assert not Path("go.bin").exists()


def test_dis_writes_source_that_assembles_to_the_image(invoke):
    put("go.bin", IMAGE + pack_binary([Instruction(37, 1, 2, 3), Instruction(0)]))
    status, out, err = invoke("dis", "go.bin")
    assert (status, err) == (0, "")
    assert out.splitlines()[:2] == ["L0:     ROR   0, 500", "        JA    L0"]
    assert invoke("dis", "go.bin", "-o", "back.tmc")[:2] == (0, "")
    invoke("asm", "back.tmc", "-o", "again.bin", "--no-append-stop")
    assert Path("again.bin").read_bytes() == Path("go.bin").read_bytes()
    assert "DATA 0," not in invoke("dis", "go.bin", "--end-mark")[1]


def test_dis_takes_names_from_an_older_source(invoke):
    invoke("asm", put("go.tmc", GOOD))
    status, out, err = invoke("dis", "go.bin", "--like", "go.tmc")
    assert (status, err) == (0, "")
    assert out == GOOD.replace("500                     //", "500                     //")
    assert invoke("dis", "go.bin", "--like", put("bad.tmc", "foo 1"))[0] == 1


def test_an_older_source_is_read_for_the_module_that_the_image_is_for(invoke):
    source = "#if MODEL == 342\nStart:  MST   2\n#else\nOther:  MST   0\n#endif\n        JA    Start\n"
    put("old.tmc", source)
    put("go.bin", pack_binary([Instruction(3, 0, 2), Instruction(22)]))
    assert invoke("dis", "go.bin", "--like", "old.tmc", "--model", "342")[1].startswith("Start:  MST   2")
    assert invoke("dis", "go.bin", "--like", "old.tmc")[0] == 1


def test_commands_of_sister_firmware_are_named(invoke):
    put("go.bin", pack_binary([Instruction(37, 1, 2, 3), Instruction(28)]))
    assert "//! DATA 37, 1, 2, 3" in invoke("dis", "go.bin")[1]
    assert "// VECT of other firmware" in invoke("dis", "go.bin")[1]
    invoke("dis", "go.bin", "-o", "back.tmc")
    invoke("asm", "back.tmc", "-o", "again.bin")
    assert Path("again.bin").read_bytes() == Path("go.bin").read_bytes()


def test_dis_refuses_a_damaged_image_with_the_offset(invoke):
    put("go.bin", IMAGE[:-3])
    status, _, err = invoke("dis", "go.bin")
    assert status == 2
    assert "go.bin: offset 16: truncated" in err


def test_fmt_writes_only_what_changes(invoke):
    put("tidy.tmc", GOOD)
    put("wild.tmc", "loop:ror 0,1//x\nja loop")
    assert invoke("fmt", "--check", "tidy.tmc", "wild.tmc")[0] == 1
    assert Path("wild.tmc").read_text() == "loop:ror 0,1//x\nja loop"
    status, out, _ = invoke("fmt", "tidy.tmc", "wild.tmc")
    assert (status, out) == (0, "wild.tmc: formatted\n")
    assert invoke("fmt", "--check", "tidy.tmc", "wild.tmc") == (0, "", "")


@pytest.mark.parametrize(
    ("codec", "mark"),
    [("utf-8", b""), ("utf-8", b"\xef\xbb\xbf"), ("utf-16-le", b"\xff\xfe"), ("utf-16-be", b"\xfe\xff"),
     ("cp1252", b"")],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_fmt_keeps_encoding_byte_order_mark_and_line_ends(invoke, codec, mark, end):
    put("old.tmc", mark + f"stop // “größer”™{end}//{end}".encode(codec))
    assert invoke("fmt", "old.tmc")[0] == 0
    expected = f"        STOP                    // “größer”™{end}//{end}"
    assert Path("old.tmc").read_bytes() == mark + expected.encode(codec)


@pytest.mark.parametrize(
    "data",
    [IMAGE, b"\xff\xfeS\0T\0\0", "stop\n".encode("utf-16-le"), b"stop\n\x00", b"stop ; note\n", b"sap 4, 0, 1a\n",
     bytes(range(256))],
)  # fmt: skip
def test_fmt_leaves_what_is_no_tmcl(invoke, data):
    status, out, err = invoke("fmt", put("p.tmc", data))
    assert (out, len(err.strip().splitlines())) == ("", 1)
    assert status in (1, 2)
    assert Path("p.tmc").read_bytes() == data


def test_utf_16_is_read_as_what_it_is(invoke):
    assert invoke("asm", put("go.tmc", b"\xff\xfe" + GOOD.encode("utf-16-le")))[0] == 0
    assert Path("go.bin").read_bytes() == IMAGE
    status, _, err = invoke("lint", put("raw.tmc", GOOD.encode("utf-16-le")))
    assert (status, err.partition(": ")[2]) == (
        2, "raw.tmc: UTF-16 without a byte order mark; save it as UTF-8\n",
    )  # fmt: skip
    put("sub.inc", GOOD.encode("utf-16-be"))
    status, _, err = invoke("lint", put("main.tmc", "#include sub.inc\nSTOP\n"))
    assert err.count("E501") == 1


def test_lint_tells_findings_with_status_1(invoke):
    put("go.tmc", "ROR 5, 1\nSTOP")
    status, out, err = invoke("lint", "go.tmc")
    assert (status, out) == (1, "")
    assert err.startswith("go.tmc:1:5: warning[W303]: no motor 5")
    put("fine.tmc", GOOD)
    assert invoke("lint", "fine.tmc") == (0, "", "")
    put("info.tmc", "Unused = 5\nSTOP")
    status, _, err = invoke("lint", "info.tmc", "fine.tmc")
    assert status == 0
    assert "information[W401]" in err


def test_an_include_file_is_linted_as_a_part_of_its_program(invoke):
    put("main.tmc", "X = 1\nCSUB Sub\nSTOP\n#include SUB.inc\nROR 5, X\n")
    put("sub.inc", "Sub: ROR 0, X\nRSUB\n")
    assert invoke("lint", "sub.inc") == (0, "", "")
    put("sub.inc", "Sub: ROR 0, X\nROR 7, 1\nRSUB\n")
    status, _, err = invoke("lint", "sub.inc")
    assert (status, err.count("[W")) == (1, 1)
    assert err.startswith("sub.inc:2:5: warning[W303]")


def test_asm_writes_one_plain_source(invoke):
    put("names.inc", "Speed = 7\n")
    put(
        "go.tmc",
        "#include names.inc\n#if MODEL == 342\nROR 0, Speed\n#else\nROL 0, Speed\n#endif\nGo:\n.x: JA .x\n",
    )
    assert invoke("asm", "go.tmc", "--emit-tmcl", "plain.tmc", "--model", "342")[0] == 0
    assert Path("plain.tmc").read_text() == (
        "// from names.inc\nSpeed = 7\n        ROR   0, Speed\nGo:\nGo_x:   JA    Go_x\n"
    )
    assert invoke("asm", "plain.tmc")[0] == 0
    assert Path("plain.bin").read_bytes() == Path("go.bin").read_bytes()


def test_lint_explains_a_code(invoke):
    status, out, err = invoke("lint", "--explain", "w502")
    assert (status, err) == (0, "")
    assert out.startswith("W502: a value that is read and lost\n")
    assert "CALCX LOAD" in out
    assert invoke("lint", "--explain", "E205")[1].startswith(
        "E205: an operand that must be one of certain words"
    )
    status, _, err = invoke("lint", "--explain", "W999")
    assert (status, len(err.splitlines())) == (2, 1)


def test_rules_are_switched_on_and_off(invoke):
    put("go.tmc", "ROR 5, 1\nL: GIO 0, 0\nJC ZE, L\nSTOP")
    assert "W206" in invoke("lint", "go.tmc", "--on", "W206", "--off", "w303")[2]
    assert invoke("lint", "go.tmc", "--off", "W303") == (0, "", "")
    assert invoke("lint", "go.tmc", "--off", "W999")[0] == 2


def test_folders_stand_for_their_sources(invoke):
    for name in ("a", "a/b", "c"):
        Path(name).mkdir()
    put("a/one.tmc", "ror 9, 1\nstop")
    put("a/b/two.tmc", "ror 8, 1\nstop")
    put("a/readme.md", "no source")
    err = invoke("lint", "a")[2]
    assert [line.partition(":")[0] for line in err.splitlines() if "[W" in line] == [
        "a/b/two.tmc",
        "a/one.tmc",
    ]
    assert invoke("fmt", "a")[1] == "a/b/two.tmc: formatted\na/one.tmc: formatted\n"
    assert invoke("lint", "c")[0] == invoke("fmt", "c")[0] == 2


def test_a_file_that_holds_no_text_does_not_keep_a_folder_from_being_treated(invoke):
    Path("a").mkdir()
    Path("a/one.tmc").write_bytes(b"\xff\xfeS")
    put("a/two.tmc", "stop\n")
    status, output, err = invoke("fmt", "a")
    assert (status, output) == (2, "a/two.tmc: formatted\n")
    assert "fmt: a/one.tmc: not UTF-16-LE at byte 2" in err
    assert invoke("lint", "a")[0] == 2


def test_a_finding_in_a_file_of_several_programs_is_printed_once(invoke):
    Path("a").mkdir()
    put("a/sub.tmc", "Sub: SAP 8, 0, 1\nRSUB\n")
    for name in ("one", "two"):
        put(f"a/{name}.tmc", "CSUB Sub\nSTOP\n#include sub.tmc\n")
    status, _, err = invoke("lint", "a")
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


def test_rubbish_is_never_a_traceback(invoke):
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
            status, _, err = invoke(name, "x.tmc")
            assert status in (0, 1, 2), number
            assert status < 2 or len(err.splitlines()) == 1, number
            assert max(map(len, err.splitlines()), default=0) < 400, number
