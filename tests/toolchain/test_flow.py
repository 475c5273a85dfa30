"""Where a program can go."""

from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.tmcl.commands import PROGRAM_SIZE, STACK_DEPTH
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.flow import CSUB, JA, JC, RSUB, STOP, Flow


def flow(text):
    program = assemble(text).program
    assert program
    return Flow(program)


def test_code_behind_an_endless_loop_is_not_reached():
    assert flow("L: ROR 0, 1\nJA L\nSTOP").reachable == {0, 1}


def test_a_program_without_stop_runs_past_its_end():
    assert flow("ROR 0, 1").reachable == {0, 1}


def test_a_subroutine_that_never_returns_ends_the_way_of_its_caller():
    graph = flow("CSUB S\nROR 0, 1\nS: STOP")
    assert graph.reachable == {0, 2}
    assert flow("CSUB S\nROR 0, 1\nSTOP\nS: RSUB").reachable == {0, 1, 2, 3}


def test_returning_through_another_subroutine_counts():
    assert 1 in flow("CSUB A\nSTOP\nA: CSUB B\nRSUB\nB: RSUB").reachable
    assert 1 not in flow("CSUB A\nSTOP\nA: CSUB B\nRSUB\nB: JA B").reachable


def test_main_is_what_runs_with_no_call_open():
    assert flow("CSUB A\nRSUB\nA: STOP\nRSUB").main == {0}
    assert flow("CSUB A\nRSUB\nA: RSUB").main == {0, 1}


def test_recursion_is_a_call_that_comes_to_itself():
    assert flow("CSUB A\nSTOP\nA: CSUB B\nRSUB\nB: JC ZE, C\nCSUB A\nC: RSUB").recursive == {2, 5}
    assert flow("L: CSUB A\nJA L\nA: RSUB").recursive == set()


def test_endless_recursion_comes_back_because_the_stack_is_full():
    assert flow("CSUB A\nSTOP\nA: CSUB A\nRSUB").reachable == {0, 1, 2, 3}


def test_depth_counts_open_calls():
    graph = flow("CSUB A\nCSUB B\nSTOP\nA: CSUB B\nRSUB\nB: RSUB")
    assert graph.depth[0] == 0
    assert graph.depth[3] == 1
    assert graph.depth[5] == 2


def test_loops_include_the_subroutines_called_from_them():
    graph = flow("ROR 0, 1\nL: CSUB A\nJC ZE, L\nSTOP\nA: CSUB B\nRSUB\nB: RSUB")
    assert graph.looping == {1, 2, 4, 5, 6}


NUMBERS = st.sampled_from([JC, JA, CSUB, RSUB, STOP, 1, 1])
PROGRAMS = st.lists(st.builds(Instruction, NUMBERS, st.just(0), st.just(0), st.integers(-1, 12)), max_size=12)


def runs(program, limit=30):
    """All ways through `program` up to so many steps: the address and the open calls at each step."""
    todo = [(0, ())]
    seen = set()
    for _ in range(limit):
        following = []
        for address, stack in todo:
            if (address, stack) in seen:
                continue
            seen.add((address, stack))
            if address >= len(program):
                continue
            number, _type, _motor, value = program[address]
            ways = []
            if number == RSUB:
                if stack:
                    ways.append((stack[-1] + 1, stack[:-1]))
            elif number == CSUB:
                if 0 <= value < len(program) and len(stack) < STACK_DEPTH:
                    ways.append((value, (*stack, address)))
                else:
                    ways.append((address + 1, stack))
            elif number == JA:
                ways.append((value, stack))
            elif number == JC:
                ways += [(value, stack), (address + 1, stack)]
            elif number != STOP:
                ways.append((address + 1, stack))
            following += [(a, s) for a, s in ways if 0 <= a <= len(program)]
        todo = following
    return seen


@given(PROGRAMS)
@settings(max_examples=300)
def test_what_a_run_comes_to_is_reachable_at_no_greater_depth(program):
    graph = Flow(program)
    for address, stack in runs(program):
        assert address in graph.reachable
        if not stack:
            assert address in graph.main
        if len(set(stack)) == len(stack) and not graph.recursive:
            assert len(stack) <= graph.depth[address]
        if stack and stack[-1] in stack[:-1]:
            assert stack[-1] in graph.recursive


def test_a_full_memory_of_calls_takes_no_time():
    program = [Instruction(CSUB, 0, 0, (n * 7 + 1) % PROGRAM_SIZE) for n in range(PROGRAM_SIZE)]
    program[-1] = Instruction(RSUB)
    assert Flow(program).recursive
    assert Flow(program).depth
    assert Flow(program).looping
