"""The one authority over motion: who moves what, and what ends it.

A *motion* is something that the server does for a window in more than one command: a held arrow, a load profile, a
search, zeroing, a stored coordinate, storing and restoring.  It belongs to the window that asked for it and ends
with STOP ALL, with the window's end or silence, with the loss of the line, or with the next command of a person
for the same motor.  What ended before its time is brought to rest.

STOP ALL latches: until a person releases it, nothing is set in motion through this server.  A real module must be
armed before anything is.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterable
from contextlib import suppress
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.host import commands as host_commands
from tmcm34x.host.effects import ALL_MOTORS, commands, consequence, moves
from tmcm34x.host.exceptions import HostError
from tmcm34x.host.steps import NUMBERS, QUIT_DOWNLOAD, RUN, STEP, STOP, Steps
from tmcm34x.ide import wire
from tmcm34x.ide.driving import attend
from tmcm34x.ide.faults import fault
from tmcm34x.ide.found import FoundMotors
from tmcm34x.ide.stopping import RETRY_S, Stopping
from tmcm34x.ide.strides import Strides
from tmcm34x.ide.under_way import JOG_PATIENCE_S, MotionUnderWay
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import MnemonicError, format_instruction, parse_instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target, Tell
    from tmcm34x.ide.window import Window

WATCH_S: Final = 0.1
CLOSE_S: Final = 5.0
"""How long the end of the server waits for motors to confirm rest."""
_STORING: Final = frozenset({NUMBERS["STAP"], NUMBERS["STGP"]})
_HARMLESS_LINES: Final = frozenset({"BIN", "STOP", ""})
"""Lines of the ASCII interface that are no commands of their own and move nothing (manual 6.6.3)."""
_AT_REST: Final = frozenset({"profile", "turn", "jog"})
"""Motions after which their motors stand, whatever ended them."""


class Authority:
    """Over the motors of `target`; `tell` takes what pages should see.

    armed: whether motors may be set in motion; a virtual module always is
    latched: whether STOP ALL holds
    """

    def __init__(self, target: Target, tell: Tell, stopped: Callable[[], Coroutine[Any, Any, None]]) -> None:
        self._target = target
        self._tell = tell
        self._stopped = stopped
        """Called when STOP ALL has stopped the program."""
        self.real = not target.ability.bench
        self.armed = not self.real
        self.latched = False
        self._numbers = count(1)
        self._motions: dict[int, MotionUnderWay] = {}
        self._stopping = Stopping(target, self._moved)
        self.strides = Strides(target, self.permit)
        self._program_doubt = ""
        self._program_task: asyncio.Task[None] | None = None
        self._started: set[int] = set()
        """Motors that were set in motion through this server and have not confirmed rest since."""
        self._program_started = False
        self._found = FoundMotors(target, lambda: self._started, self._changed)
        self.quiet = False
        """Nothing may be sent: the module would store it."""

    # What pages see

    @property
    def shape(self) -> wire.Authority:
        """How things are."""
        doubts = [wire.Doubt(motor, why) for motor, why in sorted(self._stopping.doubts.items())]
        if self._program_doubt:
            doubts.insert(0, wire.Doubt(-1, self._program_doubt))
        return wire.Authority(
            real=self.real,
            armed=self.armed,
            latched=self.latched,
            doubts=doubts,
            motions=[
                wire.MotionShape(motion.number, motion.kind, sorted(motion.motors), motion.owner.number)
                for motion in self._motions.values()
            ],
            found=self._found.text,
        )

    def _changed(self) -> None:
        self._tell(self.shape)

    def _moved(self, motor: int) -> None:
        if motor not in self._stopping.doubts:
            self._started.discard(motor)
        self._changed()

    # Permission

    def permit(self, instruction: Instruction, *, sure: bool = False) -> None:
        """See whether a person's command may be sent, and take its motors for it.  Raises `wire.RefusalError`.

        sure: what cannot be undone has been confirmed
        """
        if not sure and (text := consequence(instruction) or self._replaced(instruction)):
            raise wire.RefusalError("confirm", f"{text}.")
        moving = moves(instruction)
        if moving:
            self.permit_motion(moving)
        self._take(commands(instruction))
        if instruction.number in {RUN, STEP}:
            self._program_started = True
        if instruction.number == STOP:
            self._program_started = False

    def _replaced(self, instruction: Instruction) -> str:
        """What a command that stores a value takes the place of, in a real module."""
        if not self.real or instruction.number not in _STORING:
            return ""
        return (
            f"{format_instruction(instruction)} replaces what the EEPROM holds of this by the present value"
        )

    @property
    def free(self) -> bool:
        """Whether motors may be set in motion."""
        return self.armed and not self.latched

    def permit_line(self, line: str) -> None:
        """See whether a line of the ASCII interface may be sent.  Raises `wire.RefusalError`.

        What cannot be read here is not sent: the module takes missing operands as 0 and might move.
        """
        word = line.strip().upper()
        if word == "RUN":
            self.permit_program()
        elif word not in _HARMLESS_LINES:
            try:
                instruction = parse_instruction(line)
            except MnemonicError as error:
                raise wire.RefusalError("line", f"Not sent: {error}.") from error
            self.permit(instruction, sure=True)

    def take(self, instruction: Instruction) -> None:
        """A person has sent a command in another way than by `permit`, and was allowed to."""
        self._started.update(moves(instruction))
        self._take(commands(instruction))

    def permit_motion(self, motors: Iterable[int]) -> None:
        """Take motors for a motion that begins now.  Raises `wire.RefusalError`."""
        if self.latched:
            raise wire.RefusalError("latched", "STOP ALL holds: release it before anything moves.")
        if not self.armed:
            raise wire.RefusalError("disarmed", "Not armed: switch ARMED on before anything moves.")
        self._started.update(motors)

    def permit_program(self) -> None:
        """See whether the program may go on, and take all motors for it.  Raises `wire.RefusalError`."""
        self.permit_motion(ALL_MOTORS)
        self._take(ALL_MOTORS)
        self._program_started = True

    def _take(self, motors: Iterable[int]) -> None:
        """A person decides about these motors: whatever else was under way with them is over."""
        self.strides.drop(*motors)
        for motor in motors:
            if not self.latched:
                self._stopping.drop(motor)
        for motion in self._with(motors):
            self._remove(motion)
            self._tell_end(motion, "Another command has the motor now.")

    def _with(self, motors: Iterable[int]) -> list[MotionUnderWay]:
        wanted = frozenset(motors)
        return [motion for motion in self._motions.values() if motion.motors & wanted]

    # Arming

    def arm(self, on: bool) -> None:
        """Let motors be set in motion, or no more; with the end of it the motions end."""
        if on and not self._target.link.up:
            raise wire.RefusalError("silent", "The module does not answer: it cannot be armed.")
        self.armed = on or not self.real
        if not self.armed:
            self.end(tuple(self._motions.values()))
        self._changed()

    # Motions

    async def jog(self, owner: Window, motor: int, velocity: int) -> None:
        """An arrow is held, or with velocity 0 let go; negative turns left.  Raises `wire.RefusalError`."""
        held = next((m for m in self._with({motor}) if m.kind == "jog" and m.owner is owner), None)
        if not velocity:
            self.end([held] if held is not None else [])
        elif held is not None and held.velocity == velocity:
            held.heard_s = asyncio.get_running_loop().time()
        else:
            self.permit_motion({motor})
            self._take({motor})
            await self._rotate(self._add("jog", owner, {motor}, velocity))

    async def _rotate(self, motion: MotionUnderWay) -> None:
        (motor,) = motion.motors
        exchange = await self._target.exchange(host_commands.rotate(motor, motion.velocity))
        if exchange.status != Status.OK:
            self.end([motion])
            raise wire.RefusalError("module", f"{exchange.text}: {exchange.meaning}.")

    def begin(
        self, kind: wire.MotionKind, owner: Window, motors: Iterable[int], steps: Steps[None], end: str
    ) -> int:
        """Drive an operation for a window; the number by which it can be aborted.  Raises `wire.RefusalError`.

        end: said of it when it is complete
        """
        chosen = frozenset(motors)
        if chosen:
            self.permit_motion(chosen)
        self._take(chosen)
        motion = self._add(kind, owner, chosen)
        motion.task = asyncio.ensure_future(self._run(motion, steps, end))
        return motion.number

    def _add(
        self, kind: wire.MotionKind, owner: Window, motors: Iterable[int], velocity: int = 0
    ) -> MotionUnderWay:
        now_s = asyncio.get_running_loop().time()
        motion = MotionUnderWay(next(self._numbers), kind, owner, frozenset(motors), now_s, velocity)
        self._motions[motion.number] = motion
        self._changed()
        return motion

    async def _run(self, motion: MotionUnderWay, steps: Steps[None], end: str) -> None:
        try:
            await attend(self._target, steps)
            text, ended = end, True
        except (HostError, wire.RefusalError) as error:
            text, ended = f"{str(error).rstrip('.')}.", False
        except Exception as error:
            self._tell(fault(error, motion.kind))
            text, ended = "It ended by an error in the IDE itself.", False
        self._remove(motion, cancel=False)
        if not ended or motion.kind in _AT_REST:
            self._stopping.begin(motion.motors, searching=motion.kind == "search")
        self._tell(wire.MotionEnded(motion.number, motion.kind, ended, text))

    def _remove(self, motion: MotionUnderWay, *, cancel: bool = True) -> None:
        self._motions.pop(motion.number, None)
        if cancel and motion.task is not None:
            motion.task.cancel()
        if motion.kind in {"store", "restore"}:
            self._tell(wire.Progress("", 1, 1))
        self._changed()

    def end(self, motions: Iterable[MotionUnderWay], why: str = "") -> None:
        """Motions are over before their time: their motors are brought to rest; `why` is shown."""
        for motion in motions:
            self._remove(motion)
            self._stopping.begin(motion.motors, searching=motion.kind == "search")
            self._tell_end(motion, why)

    def _tell_end(self, motion: MotionUnderWay, why: str) -> None:
        if motion.kind != "jog":
            self._tell(wire.MotionEnded(motion.number, motion.kind, False, why))

    def abort(self, number: int) -> None:
        """End a motion by its number; one that has ended stays ended."""
        motion = self._motions.get(number)
        if motion is not None:
            self.end([motion], "Aborted.")

    def leave(self, page: Window) -> None:
        """A window is gone."""
        self.end([m for m in self._motions.values() if m.owner is page], "Its window was closed.")

    async def settle(self) -> None:
        """Bring to rest what is under way, before the line is needed.  Raises `wire.RefusalError`."""
        self.end(tuple(self._motions.values()), "A program is loaded.")
        if not await self._stopping.rest(JOG_PATIENCE_S):
            raise wire.RefusalError("busy", "Motors are being stopped: wait until they are at rest.")

    # STOP ALL

    def stop_all(self, *, downloading: bool = False) -> None:
        """Stop the program and all motors at once, and again until all have confirmed; latches."""
        first = [Instruction(QUIT_DOWNLOAD)] if downloading else []
        self._target.urgent([*first, Instruction(STOP), *map(host_commands.stop, range(MOTORS))])
        self._stop_program()
        self.strides.drop(*range(MOTORS))
        self._stopping.begin(range(MOTORS))
        # Only now: without doubts a latch says that all is at rest.
        self.latched = True
        for motion in tuple(self._motions.values()):
            self._remove(motion)
            self._tell_end(motion, "STOP ALL.")
        self._changed()

    def _stop_program(self) -> None:
        if self._program_task is None or self._program_task.done():
            self._program_doubt = "not asked yet"
            self._program_task = asyncio.ensure_future(self._confirm_program())

    async def _confirm_program(self) -> None:
        while (exchange := await self._target.exchange(Instruction(STOP))).status != Status.OK:
            self._program_doubt = exchange.meaning
            self._changed()
            await asyncio.sleep(RETRY_S)
        self._program_doubt, self._program_started = "", False
        self._found.clear()
        self._changed()
        await self._stopped()

    def release(self) -> None:
        """A person lets STOP ALL go."""
        self.latched = False
        if self._program_task is not None:
            self._program_task.cancel()
        self._program_doubt = ""
        for motor in range(MOTORS):
            self._stopping.drop(motor)
        self._changed()

    # Watching

    async def watch(self) -> None:
        """Look for ever whether windows are silent or the line is lost, and at motors found turning."""
        while True:
            await asyncio.sleep(WATCH_S)
            now_s = asyncio.get_running_loop().time()
            silent = [m for m in self._motions.values() if now_s - m.last_word_s() > m.patience_s]
            self.end(silent, "Its window was silent for too long.")
            if not self.real or self.quiet:
                continue
            if not self._target.link.up:
                self._lose()
            else:
                await self._found.look(lambda: self.quiet)

    def _lose(self) -> None:
        """The line is lost."""
        self._found.lose()
        if self.armed or self._motions:
            self.armed = False
            self.end(tuple(self._motions.values()), "The line is lost.")
            self._changed()

    def dismiss(self) -> None:
        """A person has read what was found."""
        self._found.clear()
        self._changed()

    def forget(self) -> None:
        """The module has lost its power: nothing turns any more."""
        for motion in tuple(self._motions.values()):
            self._remove(motion)
        for motor in range(MOTORS):
            self._stopping.drop(motor)
        self._started.clear()
        self._program_started = False

    # The end of the server

    def halt(self) -> None:
        """The server ends: stop at once what was started through it."""
        if self.real and (self._started or self._program_started):
            program = [Instruction(STOP)] if self._program_started else []
            self._target.urgent([*program, *map(host_commands.stop, sorted(self._started))])

    async def close(self) -> str:
        """End all, and wait a little until it is at rest; what is not known to be."""
        self.end(tuple(self._motions.values()))
        if self.real:
            if self._program_started:
                self._stop_program()
            self._stopping.begin(sorted(self._started))
        await self._stopping.rest(CLOSE_S if self.real else JOG_PATIENCE_S)
        doubts = {f"motor {motor}": why for motor, why in self._stopping.doubts.items()}
        if self._program_task is not None:
            with suppress(asyncio.TimeoutError):
                await asyncio.wait([self._program_task], timeout=RETRY_S)
            if self._program_doubt:
                doubts["the program"] = self._program_doubt
        self.forget()
        return "; ".join(f"{name}: {why}" for name, why in doubts.items())
