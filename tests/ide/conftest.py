"""Windows of tests say nothing of their own accord: motions wait for them longer than for people's.

Scans wait longer for replies too, and ask fewer addresses.
"""

import pytest

from tmcm34x.ide import scanning, under_way


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine must not end what a test has begun."""
    monkeypatch.setattr(under_way, "JOG_PATIENCE_S", 60.0)
    monkeypatch.setattr(under_way, "PATIENCE_S", 60.0)
    monkeypatch.setattr(scanning, "WAIT_S", 1.0)
    monkeypatch.setattr(scanning, "LIKELY_ADDRESSES", 2)
