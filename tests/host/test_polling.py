"""What a display polls, and when it had better not."""

from tmcm34x.host.polling import FAST, PROBE, Polling
from tmcm34x.tmcl.status import Status


def test_a_module_in_download_mode_is_asked_nothing_that_it_would_store():
    polling = Polling()
    assert polling.due()[: len(FAST)] == list(FAST)
    assert not polling.take(FAST[0], Status.LOADED, 0)
    assert polling.due() == [PROBE]
    assert not polling.take(PROBE, Status.NOT_AVAILABLE, 0)
    assert polling.due() == [PROBE]
    assert not polling.take(PROBE, Status.OK, 0)
    assert polling.due()[: len(FAST)] == list(FAST)


def test_what_is_refused_for_good_is_not_asked_again_and_no_answer_changes_nothing():
    polling = Polling()
    assert polling.take(FAST[0], Status.OK, 77)
    assert not polling.take(FAST[0], 0, 0)
    assert polling.values == {(FAST[0].key, FAST[0].motor): 77}
    assert not polling.take(FAST[1], Status.INVALID_VALUE, 0)
    assert FAST[1] not in polling.due()
    polling.forget()
    assert FAST[1] in polling.due()
