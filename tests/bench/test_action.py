"""Actions on a bench as plain values."""

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.bench.action import ACTIONS, Action, ActionError
from tmcm34x.clock import HZ, run_until


def test_an_action_is_done_at_the_present_clock_and_its_listeners_are_called():
    rig = simple_rig()
    run_until(rig, HZ)
    seen: list[tuple[Action, int]] = []
    rig.on_action.append(lambda action, now: seen.append((action, now)))
    action = Action("switch", 0, (1, "left", True))
    rig.act(action)
    run_until(rig, HZ + 1)
    assert rig.modules[0].board.switch(1, "left")
    assert seen == [(action, HZ)]


def test_a_line_that_was_held_goes_back_to_its_switches():
    rig = simple_rig()
    for active in (True, None):
        rig.act(Action("switch", 0, (0, "right", active)))
        run_until(rig, rig.now + 1)
        assert rig.modules[0].board.switch(0, "right") == bool(active)


@pytest.mark.parametrize(
    ("action", "text"),
    [
        (Action("press", 0, ()), "no action 'press'; there are switch, unplug,"),
        (Action("power", 1, (True,)), "no module 1; the bench has 1"),
        (Action("power", 0, ()), "power takes on"),
        (Action("switch", 0, (3, "left", True)), "switch: motor is motor 0..2, not 3"),
        (Action("switch", 0, (True, "left", True)), "switch: motor is motor 0..2, not True"),
        (Action("switch", 0, (0, "top", True)), "switch: side is left or right, not 'top'"),
        (
            Action("level", 0, (0, 1024)),
            "level: level is 0..1023, or null (on the command line: auto), not 1024",
        ),
        (Action("fault", 0, (0, "smoke", True)), "fault: fault is one of"),
        (Action("push", 0, (0, "hard")), "push: torque_nm is torque in newton metres, not 'hard'"),
    ],
)
def test_what_a_bench_cannot_do_is_refused_in_one_line(action: Action, text: str):
    rig = simple_rig()
    with pytest.raises(ActionError) as error:
        rig.act(action)
    assert str(error.value).startswith(text)
    assert "\n" not in str(error.value)


def test_a_module_without_drivers_has_no_driver_faults():
    with pytest.raises(ActionError, match="TMCM-342 has no drivers to fail"):
        simple_rig(342).act(Action("fault", 0, (0, "open_load_a", True)))


def test_every_action_is_a_method_of_the_world_with_its_operands():
    for row in ACTIONS.values():
        names = row.do.__code__.co_varnames[1 : row.do.__code__.co_argcount]
        assert len(names) == len(row.operands)
