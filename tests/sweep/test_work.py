"""How rows are shared out."""

from concurrent.futures import Future

from tmcm34x.sweep.single import RowResult
from tmcm34x.sweep.work import RowQueue


class Workers:
    """Do each slice at once, and keep its size."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.sizes: list[int] = []

    def submit(self, rows):
        self.sizes.append(len(rows))
        future: Future[list[RowResult]] = Future()
        future.set_result([RowResult(figures=row) for row in rows[: self.most]])
        return future


def shared_out(count, crew, most=1 << 20):
    """The sizes of the slices, and the rows in the order of their results."""
    rows = [(number,) for number in range(count)]
    workers = Workers(most)
    results = dict(
        RowQueue(rows, range(count), crew).results(workers.submit, RuntimeError, one_loss_is_all=True)
    )
    assert {number: result.figures for number, result in results.items()} == dict(enumerate(rows))
    return workers.sizes


def test_slices_of_short_runs_grow_and_become_single_rows_at_the_end():
    sizes = shared_out(10_000, 4)
    assert max(sizes) == 256
    assert sizes[:4] == [1] * 4
    assert len(sizes) < 150
    left = 10_000
    for size in sizes:
        assert size <= max(1, left // 8)
        left -= size
    assert sizes[-8:] == [1] * 8


def test_slices_of_long_runs_are_short():
    assert max(shared_out(50, 4, most=1)) == 2


def test_what_a_worker_has_not_done_of_a_slice_is_given_out_again():
    assert max(shared_out(1_000, 4, most=5)) == 10
