from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.board.models import MODELS
from tmcm34x.ide.settings import LEFT_OUT, from_text, to_tmcl, to_toml, wanted
from tmcm34x.ide.wire import RefusalError
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY


@settings(max_examples=30, deadline=None)
@given(st.sampled_from([341, 342, 343]), st.data())
def test_both_forms_give_the_same_commands_back(number, data):
    items = wanted(number)
    values = {
        item: data.draw(st.integers(0, 7))
        for item in data.draw(st.lists(st.sampled_from(items), min_size=1, unique=True))
    }
    values = {item: value for item, value in values.items() if value or item.bank in {-1, 0}}
    if values:
        model = MODELS[number]
        tmcl, toml = from_text(to_tmcl(model, values), number), from_text(to_toml(model, values), number)
        rows = {item[:3] for item in tmcl}
        assert {item for item in toml if item[:3] in rows} == set(tmcl)
        assert len(tmcl) == len(values)


def test_the_tmcl_form_looks_like_the_vendors_export():
    items = wanted(343)
    text = to_tmcl(MODELS[343], dict.fromkeys(items, 1))
    assert "//=== module settings for axis 2 ===" in text
    assert "SAP 4, 2, 1             \t// maximum positioning speed [velocity units]" in text


def test_what_could_cut_the_line_or_wipe_the_program_is_left_alone_both_ways():
    text = to_toml(MODELS[343], dict.fromkeys(wanted(343), 1))
    assert not any(key in text for key in LEFT_OUT)
    program = "\n".join(f"SGP {BY_KEY[key].number}, 0, 1" for key in sorted(LEFT_OUT))
    with pytest.raises(RefusalError):
        from_text(program, 343)
    assert from_text(program + "\nSAP 4, 0, 5", 343) == [Instruction(5, 4, 0, 5)]


def test_parameters_that_the_module_does_not_have_are_skipped():
    assert from_text("[axis.0]\nmax_current = 3\nmax_speed = 4\n", 342) == [Instruction(5, 4, 0, 4)]


@pytest.mark.parametrize(
    "text",
    ["", "ROR 0, 1", "SAP 4, 0", "# x\n[axis.0]\nnonsense = 1", "# x\n[axis.7]\nmax_speed = 1", "# x\naxis = 3",
     "# x\n[coordinates]\n3 = 4", "# x\n[variables]\nx = 1", "# x\n[module]\nauto_start = 'on'",
     "[axis", "\0", "# only"],
)  # fmt: skip
def test_a_text_without_settings_is_refused_with_a_reason(text):
    with pytest.raises(RefusalError) as refused:
        from_text(text, 343)
    assert refused.value.code == "settings"
    assert str(refused.value)
