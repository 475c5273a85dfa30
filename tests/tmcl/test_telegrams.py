"""What logs say of telegrams."""

import pytest

from tmcm34x.tmcl.datagram import unpack_can_reply, unpack_record, unpack_reply, unpack_request
from tmcm34x.tmcl.telegrams import explain


@pytest.mark.parametrize(
    ("take", "size"), [(unpack_record, 7), (unpack_request, 8), (unpack_reply, 10), (unpack_can_reply, 6)]
)
def test_bytes_of_another_number_are_refused(take, size):
    with pytest.raises(ValueError, match=f"not {size}$"):
        take(bytes(size))


@pytest.mark.parametrize(
    ("direction", "kind", "data", "meaning"),
    [
        (">", "telegram", "01 04 00 01 00 01 5f 90 f6", ("MVP ABS, 1, 90000", 1, 0)),
        (">", "telegram", "01 84 00 00 00 00 00 00 85", ("132 start download mode, 0", 1, 0)),
        ("<", "telegram", "02 01 64 04 00 01 5f 90 5b", ("100 successfully executed, value 90000", 1, 100)),
        ("<", "telegram", "02 33 34 33 56 34 2e 33 36", ("version 343V4.36", None, 100)),
        ("<", "telegram", "02 04 00 00 00 00 00 05 0b", ("a reply of its own form", None, 0)),
        ("<", "telegram", "02 01 64 04 00 01 5f 90 00", ("no telegram", None, 0)),
        (">", "frame", "06 01 00 00 00 00 00", ("GAP 1, 0", None, 0)),
        ("<", "frame", "01 64 06 00 00 00 05", ("100 successfully executed, value 5", 1, 100)),
        (">", "text", "41 4d 53 54 0d", ("'AMST\\r'", None, 0)),
        ("<", "incomplete", "02 01", ("incomplete", None, 0)),
    ],
)
def test_telegrams_are_explained(direction, kind, data, meaning):
    assert explain(direction, bytes.fromhex(data), kind) == meaning
