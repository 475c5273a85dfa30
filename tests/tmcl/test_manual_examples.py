"""The manual's 38 binary examples, both ways."""

import csv
import re
from pathlib import Path

import pytest

from tmcm34x.tmcl import datagram, mnemonic
from tmcm34x.tmcl.datagram import Instruction, Reply

ROWS = list(
    csv.DictReader(
        (Path(__file__).parent.parent / "vectors" / "manual_examples.tsv").read_text().splitlines()[1:],
        delimiter="\t",
    )
)
REQUESTS = [pytest.param(row, id=row["mnemonic"]) for row in ROWS if row["kind"] == "request"]
REPLIES = [pytest.param(row, id=row["section"]) for row in ROWS if row["kind"] == "reply"]


def numbers(text: str) -> tuple[str, list[int]]:
    """A mnemonic's words, and its numbers whatever their base."""
    words = re.findall(r"[A-Za-z]\w*", re.sub(r"\$[0-9a-f]+", "", text))
    values = [int(n[1:], 16) if n[0] == "$" else int(n) for n in re.findall(r"\$[0-9a-f]+|-?\b\d+", text)]
    return " ".join(words), values


def test_there_are_38_examples():
    assert len(ROWS) == 38
    assert len(REPLIES) == 4


@pytest.mark.parametrize("row", REQUESTS)
def test_a_request_packs_to_the_printed_bytes(row):
    telegram = datagram.pack_request(1, mnemonic.parse_instruction(row["mnemonic"]))
    assert telegram.hex(" ") == row["datagram"]


@pytest.mark.parametrize("row", REQUESTS)
def test_the_printed_bytes_unpack_to_the_request(row):
    address, instruction = datagram.unpack_request(bytes.fromhex(row["datagram"]))
    assert address == 1
    assert numbers(mnemonic.format_instruction(instruction)) == numbers(row["mnemonic"])


@pytest.mark.parametrize("row", REPLIES)
def test_a_reply_matches_the_printed_bytes_both_ways(row):
    fields = dict(part.split("=") for part in row["mnemonic"].split())
    reply = Reply(2, 1, int(fields["status"]), int(fields["command"]), int(fields["value"]))
    assert datagram.pack_reply(reply).hex(" ") == row["datagram"]
    assert datagram.unpack_reply(bytes.fromhex(row["datagram"])) == reply


def test_a_wrong_checksum_is_told():
    with pytest.raises(datagram.ChecksumError, match="expected 0x63"):
        datagram.unpack_request(bytes.fromhex("01 01 00 02 00 00 01 5e 62"))


@pytest.mark.parametrize("size", [7, 8])
def test_can_frames_carry_the_same_fields(size):
    instruction = Instruction(4, 1, 2, -1000)
    data = datagram.pack_can_request(instruction, size)
    assert len(data) == size
    assert datagram.unpack_can_request(data) == instruction
    reply = Reply(2, 1, 100, 4, -1000)
    assert datagram.unpack_can_reply(datagram.pack_can_reply(reply, size), host=2) == reply
