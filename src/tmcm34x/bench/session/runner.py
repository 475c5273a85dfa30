"""Cases on all their models and links in virtual time, or once on a real module, and what came of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tmcm34x.bench.rig import BenchError, simple_rig
from tmcm34x.bench.session.actions import Happen, Send, SendBytes
from tmcm34x.bench.session.errors import SessionError, SessionSyntaxError
from tmcm34x.bench.session.player import PlayedLine, Player, Step
from tmcm34x.bench.session.wires import open_wire
from tmcm34x.host.effects import moves
from tmcm34x.tmcl.datagram import ChecksumError, unpack_request

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.bench.session.language import Case


@dataclass
class CaseResult:
    """What came of a case on one model over one kind of line."""

    case: Case
    model: int
    kind: str
    lines: int = 0
    """Lines that were played."""
    skipped: int = 0
    """Lines that need a bench, on a real module."""
    error: SessionError | None = None

    @property
    def name(self) -> str:
        """The case and where it was played."""
        return f"{self.case.title} [{self.model} {self.kind}]"


# Virtual


def make_rig(case: Case, model: int, bench: str = "") -> Rig:
    """A fresh rig for a case: its own bench, else the one in the text `bench`, else bare motors.

    Raises `SessionSyntaxError` for a bench that cannot be built.
    """
    text = case.bench or bench
    if not text:
        return simple_rig(model)
    from tmcm34x.bench.builder import build
    from tmcm34x.bench.description import parse, with_model

    try:
        return build(with_model(parse(text), model))
    except BenchError as error:
        raise SessionSyntaxError(str(case.path), case.line, 0, f"bench: {error}") from None


def play(case: Case, wire: PlayedLine, model: int, player: Player | None = None) -> Player:
    """Play a case on a module of type `model` over `wire`.  Raises `SessionFailedError`."""
    player = player or Player(wire, str(case.path), case.title)
    for step in case.steps:
        if model in step.models:
            player.play(step)
    player.finish()
    return player


def variants(case: Case, models: frozenset[int], kinds: frozenset[str]) -> Iterator[tuple[int, str]]:
    """The models and kinds of lines on which to play a case, among those that are wanted."""
    for model in sorted(case.models & models):
        for kind in sorted(case.kinds & kinds, reverse=True):
            yield model, kind


def run(
    cases: Sequence[Case], models: frozenset[int], kinds: frozenset[str], bench: str = ""
) -> Iterator[CaseResult]:
    """Play cases on virtual modules, each on all the models and kinds of lines that it names and that are wanted."""
    for case in cases:
        for model, kind in variants(case, models, kinds):
            result = CaseResult(case, model, kind)
            try:
                play(case, open_wire(kind, make_rig(case, model, bench)), model)
            except SessionError as error:
                result.error = error
            result.lines = sum(model in step.models for step in case.steps)
            yield result


# Real


def may_move(step: Step) -> bool:
    """Whether a line may move a motor; of bytes that are no telegram that is not known."""
    action = step.action
    if isinstance(action, SendBytes):
        try:
            return bool(moves(unpack_request(action.data)[1]))
        except (ValueError, ChecksumError):
            return True
    return isinstance(action, Send) and bool(moves(action.instruction))


def moving_line(case: Case, model: int) -> Step | None:
    """The first line of a case that may move a motor of a real module."""
    steps = [] if case.bench else playable(case, model)
    return next((step for step in steps if may_move(step)), None)


def playable(case: Case, model: int) -> list[Step]:
    """The lines of a case that a real module can play.

    What follows an event of the bench depends on it, and is left out too; of measurements only the line itself.
    """
    found: list[Step] = []
    for step in case.steps:
        if model in step.models:
            if isinstance(step.action, Happen):
                break
            if not step.action.needs_bench:
                found.append(step)
    return found


def run_real(
    cases: Sequence[Case], open_player: Callable[[Case], Player], model: int, kind: str
) -> Iterator[CaseResult]:
    """Play cases on a real module of type `model` over a kind of line.

    Lines that need a bench are counted and left out, and so are cases that are not for this kind of line.
    """
    for case in cases:
        if model not in case.models:
            continue
        steps = [] if case.bench else playable(case, model)
        wanted = sum(model in step.models for step in case.steps)
        result = CaseResult(case, model, kind, len(steps), wanted - len(steps))
        if steps and kind in case.kinds:
            try:
                player = open_player(case)
                for step in steps:
                    player.play(step)
                player.finish()
            except SessionError as error:
                result.error = error
        else:
            result.lines, result.skipped = 0, wanted
        yield result
