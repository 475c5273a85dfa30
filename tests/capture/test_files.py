"""Recordings in their four forms: written, read back, read from others, cut off."""

import shutil
import struct
import subprocess

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.bench.session.language import parse
from tmcm34x.bench.session.runner import make_rig, play
from tmcm34x.bench.session.wires import MemorySerial
from tmcm34x.capture import candump, files, hexlog, pcapng, session_file
from tmcm34x.capture.check import check
from tmcm34x.capture.dissector import dissector
from tmcm34x.capture.latency import rows, summary
from tmcm34x.capture.record import Record, RecordingError, from_sink
from tmcm34x.tmcl.datagram import (
    Instruction,
    Reply,
    pack_can_reply,
    pack_can_request,
    pack_reply,
    pack_request,
)
from tmcm34x.tmcl.mnemonic import parse_instruction

MS = 1_000_000


def asked(text, at_ms, address=1):
    return Record(at_ms * MS, "tcp", ">", "telegram", pack_request(address, parse_instruction(text)))


def answered(status, command, value, at_ms, *addresses):
    address, host = addresses or (1, 2)
    data = pack_reply(Reply(host, address, status, command, value))
    return Record(at_ms * MS, "tcp", "<", "telegram", data)


SERIAL = [
    asked("MVP ABS, 1, -5000", 0),
    answered(100, 4, -5000, 2),
    asked("GAP 1, 1", 10),
    answered(100, 6, -12, 13),
    asked("138 0, 0, 7", 20, 3),
    answered(100, 138, 7, 21, 3, 9),
    answered(128, 138, 7, 500, 3, 9),
    Record(600 * MS, "tcp", ">", "telegram", bytes.fromhex("018800000000000089")),
    Record(601 * MS, "tcp", "<", "telegram", b"\x02343V4.36"),
    Record(700 * MS, "tcp", ">", "incomplete", b"\x01\x06\x01"),
    Record(800 * MS, "tcp", ">", "telegram", bytes.fromhex("010601000000000099")),
]
CAN = [
    Record(0, "can0", ">", "frame", pack_can_request(Instruction(6, 4)), 1),
    Record(2 * MS, "can0", "<", "frame", pack_can_reply(Reply(2, 1, 100, 6, 1000)), 2),
    Record(5 * MS, "can0", ">", "frame", pack_can_request(Instruction(6, 4), 8), 1),
]


def same(found, expected, *, lines=True):
    for one, other in zip(found, expected, strict=True):
        assert one.data == other.data
        assert (one.direction, one.identifier, one.time_ns) == (
            other.direction,
            other.identifier,
            other.time_ns,
        )
        assert not lines or one.line == other.line


@pytest.mark.parametrize("records", [SERIAL, CAN])
def test_a_session_gives_back_what_was_recorded(records, tmp_path):
    text = session_file.write(records)
    same(session_file.read(text, tmp_path), records)


@pytest.mark.parametrize("order", [1, -1])
def test_a_session_keeps_lines_of_both_kinds_apart(order, tmp_path):
    """As `serve --record` with a pseudo terminal and a CAN bus writes it."""
    serial = [asked("GAP 4, 0", 0), answered(100, 6, 1000, 0)]
    first, second = (serial, CAN[:2])[::order]
    mixed = [record for pair in zip(first, second, strict=True) for record in pair]
    records = [record._replace(time_ns=number * MS) for number, record in enumerate(mixed)]
    same(session_file.read(session_file.write(records), tmp_path), records)
    assert check(records, simple_rig()) == []


def test_a_session_says_in_words_what_words_can_say():
    assert session_file.write(SERIAL).splitlines() == [
        "# links: serial",
        "",
        "== recording",
        "# line tcp",
        "0.000000000 > MVP ABS, 1, -5000",
        "0.002000000 < 100 -5000",
        "0.010000000 > GAP 1, 1",
        "0.013000000 < 100 -12",
        "@ 3 host 2",
        "0.020000000 > 138 0, 0, 7",
        "@ 3 host 9",
        "0.021000000 < 100 7",
        "0.500000000 < 128 7",
        "@ 1 host 9",
        "0.600000000 > 136 0, 0, 0",
        "0.601000000 < 02 33 34 33 56 34 2e 33 36",
        "0.700000000 > 01 06 01",
        "0.800000000 > 01 06 01 00 00 00 00 00 99",
    ]


def test_a_recorded_session_can_be_played():
    text = session_file.write([asked("MVP ABS, 1, 500", 5), answered(100, 4, 500, 7), asked("GAP 4, 1", 300)])
    (case,) = parse(text + "0.4 < 100 1000\n+ 1 s\n")
    player = play(case, MemorySerial(make_rig(case, 343)), 343)
    assert player.now == pytest.approx(16e6 * 1.3, rel=1e-3)


def test_a_recorded_reply_may_come_a_little_later():
    text = "== slow\n> SGP 75, 0, 40\n0.001 < 100 40\n0.1 > GAP 4, 0\n0.102 < 100 1000\n"
    (case,) = parse(text)
    play(case, MemorySerial(make_rig(case, 343)), 343)


@pytest.mark.parametrize("records", [SERIAL, CAN])
def test_pcapng_gives_back_what_was_recorded(records):
    assert pcapng.read(pcapng.write(records)) == records


def test_pcapng_of_another_byte_order_and_resolution_is_read():
    def block(kind, body):
        return struct.pack(">II", kind, len(body) + 12) + body + struct.pack(">I", len(body) + 12)

    payload = pcapng.HEAD.pack(1, 0, 0, 0) + SERIAL[0].data
    data = block(pcapng.SECTION, struct.pack(">IHHq", pcapng.BYTE_ORDER, 1, 0, -1))
    data += block(pcapng.INTERFACE, struct.pack(">HHI", 147, 0, 0))
    padded = payload + bytes(-len(payload) % 4)
    data += block(5, bytes(12))
    data += block(pcapng.PACKET, struct.pack(">IIIII", 0, 0, 5000, len(payload), len(payload)) + padded)
    (record,) = pcapng.read(data)
    assert (record.time_ns, record.line, record.data) == (5 * MS, "interface 0", SERIAL[0].data)


@pytest.mark.parametrize("cut", range(1, 60, 7))
def test_a_pcapng_file_that_was_cut_off_gives_what_is_whole(cut):
    records = pcapng.read(pcapng.write(SERIAL)[:-cut])
    assert records == SERIAL[: len(records)]
    assert len(records) >= len(SERIAL) - 2


def test_a_pcapng_file_that_is_damaged_is_refused():
    data = bytearray(pcapng.write(SERIAL))
    data[32] = 3
    with pytest.raises(RecordingError, match="begins no block"):
        pcapng.read(bytes(data))
    section = pcapng.write([])
    with pytest.raises(RecordingError, match="description of an interface is too short"):
        pcapng.read(section + struct.pack("<III", 1, 12, 12))
    with pytest.raises(RecordingError, match="not a pcapng file"):
        pcapng.read(b"\0\0\0\0")


def test_a_record_at_a_time_that_no_clock_reaches_is_refused():
    early, late = (SERIAL[0]._replace(time_ns=time_ns) for time_ns in (0, 1 << 72))
    with pytest.raises(RecordingError, match="9,000 years after the first"):
        check([early, late], simple_rig(343))


def test_candump_gives_back_what_was_recorded():
    text = candump.write(CAN)
    assert text.splitlines()[0] == "(0000000000.000000) can0 001#06040000000000"
    same(candump.read(text), CAN)


def test_other_frames_of_a_bus_are_passed_over():
    text = "(1.5) can0 123#R\n(1.6) can0 456#0102\n(2.000001) vcan0 001#06040000000000 T\n(3.0) can0 0"
    (record,) = candump.read(text)
    assert (record.line, record.time_ns) == ("vcan0", 2_000_001_000)
    with pytest.raises(RecordingError, match="line 1: not a line of candump"):
        candump.read("what is this\n(2.0) can0 001#06040000000000\n")


@pytest.mark.parametrize(
    "text",
    [
        "0.5 > 01 06 04 00 00 00 00 00 0b\n0.6 < 02 01 64 06 00 00 03 e8 58\n",
        "TX: 01060400000000000B\nRX: 02016406000003E858\n",
        "01 06 04 00 00 00 00 00 0B\n02 01 64 06 00 00 03 E8 58\n",
        "[12.25] send 0x01,0x06,0x04,0x00,0x00,0x00,0x00,0x00,0x0b\n"
        "[12.26] recv 0x02,0x01,0x64,0x06,0x00,0x00,0x03,0xe8,0x58\n",
        "Log of 2019\n\n01 06 04 00 00 00 00 00 0B | GAP\nfine\n02 01 64 06 00 00 03 E8 58 | 1000\n",
    ],
)
def test_logs_in_hexadecimal_are_read(text):
    records = [record for record in hexlog.read(text) if record.kind == "telegram"]
    assert [record.direction for record in records] == [">", "<"]
    assert records[0].instruction == Instruction(6, 4)
    assert records[1].time_ns >= records[0].time_ns


def test_a_log_in_hexadecimal_gives_back_what_was_recorded():
    same(hexlog.read(hexlog.write(SERIAL)), SERIAL, lines=False)


# By name


@pytest.mark.parametrize("suffix", [".session", ".pcapng", ".hex"])
def test_files_are_written_and_read_by_name(tmp_path, suffix):
    path = tmp_path / f"recording{suffix}"
    assert files.write(SERIAL, path) == len(SERIAL)
    same(files.read(path), SERIAL, lines=False)


@pytest.mark.parametrize("cut", [1, 3, 9, 12, 20])
def test_a_session_that_was_cut_off_is_read_as_far_as_it_goes(tmp_path, cut):
    path = tmp_path / "cut.session"
    path.write_text(session_file.write(SERIAL[:4])[:-cut])
    assert len(files.read(path)) in {3, 4}
    path.write_text(f"{session_file.write(SERIAL[:2])}0.5 > FOO\n0.6 > G")
    with pytest.raises(RecordingError, match="unknown command FOO"):
        files.read(path)


def test_names_of_lines_and_texts_are_left_out_on_request(tmp_path):
    path = tmp_path / "recording.pcapng"
    text = Record(5, "tcp 10.0.0.7:5123", ">", "text", b"my name")
    files.write([SERIAL[0]._replace(line="tcp 10.0.0.7:5123"), text], path, anonymous=True)
    (record,) = files.read(path)
    assert record.line == "1"
    assert b"10.0.0.7" not in path.read_bytes()


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("gone.hex", None, "No such file"),
        ("empty.hex", b"", "no telegrams in this file"),
        ("picture.png", b"\x89PNG\0\0", "neither text nor a pcapng file"),
        ("bad.session", b"== a\n> FOO\n", "bad.session:2:3: unknown command FOO"),
    ],
)
def test_a_file_that_cannot_be_read_is_named(tmp_path, name, data, problem):
    path = tmp_path / name
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(RecordingError, match=problem):
        files.read(path)


def test_a_name_without_a_form_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"recordings are \.session"):
        files.write(SERIAL, tmp_path / "recording.doc")


def test_the_name_of_a_can_line_carries_the_identifier():
    record = from_sink(5, "slcan 001", ">", CAN[0].data, "frame")
    assert (record.line, record.identifier) == ("slcan", 1)


# Latencies


def test_replies_have_latencies():
    latencies = [row.latency_ns for row in rows(SERIAL)]
    assert latencies[:4] == [None, 2 * MS, None, 3 * MS]
    assert summary(SERIAL) == "6 requests, 5 replies, latency 1.000 ms to 3.000 ms, median 2.000 ms"
    assert summary([]) == "0 requests, 0 replies"


# Wireshark


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed; CI installs it")
def test_the_dissector_names_commands_parameters_and_statuses(tmp_path):
    lua, capture = tmp_path / "tmcl.lua", tmp_path / "capture.pcapng"
    lua.write_text(dissector())
    refused = [asked("SAP 4, 0, 9999", 900), answered(4, 5, 9999, 901)]
    capture.write_bytes(pcapng.write([*SERIAL, *refused, *CAN]))
    fields = [
        "_ws.col.Info",
        "tmcl.command",
        "tmcl.parameter",
        "tmcl.status",
        "tmcl.value",
        "tmcl.checksum.ok",
    ]
    command = ["tshark", "-X", f"lua_script:{lua}", "-r", capture, "-T", "fields", "-E", "separator=|"]
    command += [part for field in fields for part in ("-e", field)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Lua" not in result.stderr, result.stderr
    found = [row.split("|") for row in result.stdout.splitlines()]
    assert found[0][0] == "MVP ABS 0, 1, -5000"
    assert found[1] == ["100 successfully executed, MVP, -5000", "4", "", "100", "-5000", found[0][5]]
    assert found[2][:3] == ["GAP 1, 1, 0 (actual position)", "6", "actual position"]
    assert found[8][0] == "version 343V4.36"
    assert found[9][0] == "incomplete"
    assert found[10][5] != found[0][5], "the wrong checksum is shown"
    assert found[11][0] == "SAP 4, 0, 9999 (maximum positioning speed)"
    assert found[12][0] == "4 invalid value, SAP, 9999"
    assert found[13][0] == "GAP 4, 0, 0 (maximum positioning speed)"
    assert found[14][0] == "100 successfully executed, GAP, 1000"
