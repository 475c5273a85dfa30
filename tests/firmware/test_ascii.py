from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.programs import Wire, direct, module_with, run_ms
from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.tmcl.datagram import Instruction, pack_request

NO_ECHO, LINE_ECHO, START = 0x20, 0x10, 0x01


def ascii_host(echo: int = NO_ECHO, source: str = "") -> Wire:
    """A host whose port speaks ASCII."""
    module = module_with(source)
    direct(module, f"SGP 67, 0, {echo}")
    wire = Wire(module)
    wire.port.enter_text(True)
    return wire


def test_command_139_enters_and_bin_leaves() -> None:
    wire = Wire(module_with())
    assert wire.ask(139).status == 100
    assert wire.port.ascii_mode
    assert wire.send(b"ABIN\r") == b"ABIN\rBA 100 0\r"
    assert not wire.port.ascii_mode
    assert wire.ask(10, 66).value == 1


def test_telegrams_may_follow_bin_in_one_piece() -> None:
    wire = ascii_host()
    telegram = pack_request(1, Instruction(10, 66))
    assert wire.send(b"ABIN\r" + telegram) == b"BA 100 0\r" + bytes.fromhex("02 01 64 0a 00 00 00 01 72")


def test_ascii_lines_may_follow_139_in_one_piece() -> None:
    wire = Wire(module_with())
    telegram = pack_request(1, Instruction(139))
    assert wire.send(telegram + b"AGAP 4, 0\r")[9:] == b"AGAP 4, 0\rBA 100 1000\r"


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        (b"AMVP ABS, 1, 50000\r", b"BA 100 50000\r"),
        (b"A MVP ABS, 1, 50000\r", b"BA 100 50000\r"),
        (b"AROL 2, 500\r", b"BA 100 500\r"),
        (b"A MST 1\r", b"BA 100 0\r"),
        (b"AMST\r", b"BA 100 0\r"),
        (b"ASAP, 4, 0, 996\r", b"BA 100 996\r"),
        (b"ASAP 140, 0, 6\r", b"BA 100 6\r"),
        (b"A gap 4 , 0\r", b"BA 100 1000\r"),
        (b"\nAGAP 4 0\r\n", b"BA 100 1000\r"),
        (b"AGAP 200, 0\r", b"BA 3 0\r"),
        (b"ASAP 4, 0, 5000\r", b"BA 4 5000\r"),
        (b"AGAP 4, 7\r", b"BA 4 0\r"),
        (b"ARSAP 4; 0\r", b"BA 4 0\r"),
        (b"ASPIN 1\r", b"BA 2 0\r"),
        (b"A\r", b"BA 2 0\r"),
        (b"A6 4, 0\r", b"BA 2 0\r"),
        (b"ACALC ADD, 1\r", b"BA 6 0\r"),
        (b"AWAIT TICKS, 0, 1\r", b"BA 6 0\r"),
        (b"AMVP FAR, 1, 1\r", b"BA 4 0\r"),
        (b"AGAP 4, 0, 0, 0\r", b"BA 4 0\r"),
        (b"AGAP four, 0\r", b"BA 4 0\r"),
        (b"A" + b"9" * 500 + b"\r", b"BA 2 0\r"),
        (b"A\xff\x00\x1b[A\r", b"BA 2 0\r"),
        (b"AUF0 1, 2, 3\r", b"BA 6 3\r"),
    ],
)
def test_lines_and_their_replies(line: bytes, reply: bytes) -> None:
    assert ascii_host().send(line) == reply


def test_the_position_is_answered_with_its_sign() -> None:
    wire = ascii_host()
    direct(wire.port.module, "SAP 1, 1, -5000")
    assert wire.send(b"AGAP 1, 1\r") == b"BA 100 -5000\r"


def test_each_character_is_echoed_once_the_module_is_addressed() -> None:
    wire = ascii_host(0)
    assert [wire.send(bytes((character,))) for character in b"AGAP 4, 0\r"] == [
        *(bytes((character,)) for character in b"AGAP 4, 0"),
        b"\rBA 100 1000\r",
    ]
    assert wire.send(b"BGAP 4, 0\r") == b""


def test_the_whole_line_is_echoed_after_its_return() -> None:
    wire = ascii_host(LINE_ECHO)
    assert wire.send(b"A GAP 4,0") == b""
    assert wire.send(b"\r") == b"A GAP 4,0\rBA 100 1000\r"


@pytest.mark.parametrize("echo", [NO_ECHO, NO_ECHO | LINE_ECHO])
def test_without_echo_there_is_the_reply_only(echo: int) -> None:
    assert ascii_host(echo).send(b"AGAP 4, 0\r") == b"BA 100 1000\r"


def test_backspace_erases() -> None:
    wire = ascii_host(0)
    assert wire.send(b"AGAO\x08P 4\x7f5, 0\r") == b"AGAO\x08 \x08P 4\x08 \x085, 0\rBA 100 1000\r"
    assert wire.send(b"\x08\x08") == b""
    assert wire.send(b"B\x08AGAP 4, 0\r").endswith(b"BA 100 1000\r")


def test_lines_for_others_are_silence() -> None:
    wire = ascii_host(0)
    assert wire.send(b"BSAP 4, 0, 5\rCBIN\r\rzzz\r") == b""
    assert wire.port.ascii_mode
    assert direct(wire.port.module, "GAP 4, 0") == (100, 1000)


def test_letters_follow_the_addresses() -> None:
    wire = ascii_host()
    direct(wire.port.module, "SGP 66, 0, 3")
    direct(wire.port.module, "SGP 76, 0, 26")
    assert wire.send(b"CGAP 4, 0\r") == b"ZC 100 1000\r"
    assert wire.send(b"AGAP 4, 0\r") == b""
    direct(wire.port.module, "SGP 66, 0, 0")
    assert wire.send(b"@GAP 4, 0\r") == b"Z@ 100 1000\r"
    direct(wire.port.module, "SGP 66, 0, 33")
    assert wire.send(b"AGAP 4, 0\r") == b""
    assert wire.send(b"aGAP 4, 0\r") == b"Za 100 1000\r"
    direct(wire.port.module, "SGP 66, 0, 1")
    assert wire.send(b"aGAP 4, 0\r") == b""


def test_run_starts_the_program_and_stop_stops_it() -> None:
    wire = ascii_host(source="SIO 0, 2, 1 \n WAIT TICKS, 0, 10 \n Loop: JA Loop")
    module = wire.port.module
    for _ in range(2):
        assert wire.send(b"ARUN\r") == b"BA 100 0\r"
        run_ms(module, 50)
        assert module.board.outputs == 1
        assert module.program.counter == 1
        run_ms(module, 100)
        assert module.program.active
        assert wire.send(b"ASTOP\r") == b"BA 100 0\r"
        assert not module.program.active
        direct(module, "SIO 0, 2, 0")


def test_parameter_67_starts_in_ascii_mode() -> None:
    module = module_with()
    wire = Wire(module)
    direct(module, f"SGP 67, 0, {NO_ECHO | START}")
    assert not wire.port.ascii_mode
    module.reset()
    assert wire.port.ascii_mode
    assert wire.send(b"AGGP 67, 0\r") == b"BA 100 33\r"


def test_replies_wait_for_the_telegram_pause_and_stay_in_order() -> None:
    wire = ascii_host(0)
    direct(wire.port.module, "SGP 75, 0, 15")
    assert wire.send(b"AGAP 4, 0\r") == b""
    run_ms(wire.port.module, 16)
    assert wire.send(b"") == b"AGAP 4, 0\rBA 100 1000\r"


def test_disabled_replies_are_not_sent() -> None:
    wire = ascii_host()
    assert wire.send(b"ASGP 255, 0, 1\r") == b""
    assert wire.send(b"AGAP 4, 0\r") == b""
    wire.send(b"ASGP 255, 0, 0\r")
    assert wire.send(b"AGAP 4, 0\r") == b"BA 100 1000\r"


@pytest.mark.parametrize(
    "row", [row for row in COMMANDS if "ascii" in row.where], ids=lambda row: row.mnemonic
)
def test_every_listed_command_is_known(row) -> None:
    operands = ", ".join("1" if operand.name == "bytes" else "0" for operand in row.operands)
    reply = ascii_host().send(f"A{row.mnemonic} {operands}\r".encode())
    status = (
        6 if row.mnemonic.startswith("UF") else 3 if row.mnemonic in {"STAP", "RSAP", "SGP", "SIO"} else 100
    )
    assert reply.startswith(b"BA %d " % status)


CHARACTERS = st.lists(
    st.one_of(
        st.binary(max_size=20),
        st.sampled_from(
            [b"A", b"B", b"\r", b"\n", b"\x08", b"SAP ", b"GAP ", b"BIN", b"RUN\r", b"MVP ABS, 0, ", b"-9"]
        ),
    ),
    max_size=20,
).map(b"".join)


@settings(max_examples=200)
@given(CHARACTERS, st.sampled_from([0, LINE_ECHO, NO_ECHO]), st.lists(st.integers(0, 50), max_size=4))
def test_any_characters_do_no_harm(characters: bytes, echo: int, cuts: list[int]) -> None:
    wire = ascii_host(echo, "STOP")
    for cut in cuts:
        wire.send(characters[:cut])
        characters = characters[cut:]
    wire.send(characters)
    wire.port.enter_text(True)
    direct(wire.port.module, "SGP 255, 0, 0")
    direct(wire.port.module, f"SGP 67, 0, {NO_ECHO}")
    wire.send(b"\r")
    assert wire.send(b"AGGP 67, 0\r") == b"BA 100 32\r"


def test_a_line_of_text_is_a_sign_of_life() -> None:
    wire = ascii_host()
    assert not wire.port.idle
    direct(wire.port.module, "SGP 68, 0, 100")
    direct(wire.port.module, "ROR 0, 500")
    for _ in range(4):
        run_ms(wire.port.module, 60)
        wire.send(b"AGAP 4, 0\r")
    assert direct(wire.port.module, "GAP 2, 0") == (100, 500)
    run_ms(wire.port.module, 200)
    assert direct(wire.port.module, "GAP 2, 0") == (100, 0)
