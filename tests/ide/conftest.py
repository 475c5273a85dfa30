"""Windows of tests say nothing of their own accord: motions wait for them longer than for people's."""

import pytest

from tmcm34x.ide import motions


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine must not end what a test has begun."""
    monkeypatch.setattr(motions, "JOG_PATIENCE_S", 60.0)
    monkeypatch.setattr(motions, "PATIENCE_S", 60.0)
