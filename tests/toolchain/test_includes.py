"""Who includes whom, and names without regard to case."""

import pytest

from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.includes import fitting, included, programs_with, standard


@pytest.mark.parametrize(
    ("name", "names", "expected"),
    [
        ("a.inc", ["A.INC", "a.inc"], "a.inc"),
        ("a.inc", ["A.INC", "b.inc"], "A.INC"),
        ("a.inc", ["A.INC", "A.inc"], None),
        ("a.inc", [], None),
    ],
)
def test_a_name_fits_where_only_one_does(name, names, expected):
    assert fitting(name, names) == expected


def test_included_files_are_found_without_parsing():
    text = '#include a.inc // one\n  # INCLUDE "sub\\\\B.inc"\n// #include c.inc\nSTOP #include d.inc\n#include <e.inc>'
    assert included(text) == ["a.inc", "b.inc", "e.inc"]


def test_the_programs_of_an_include_file_are_at_the_top():
    files = {
        "main.tmc": "#include a.inc",
        "a.inc": "#include B.inc",
        "b.inc": "#include a.inc",
        "other.tmc": "STOP",
        "second.tmc": "#include b.inc",
    }

    def read(name):
        if name == "other.tmc":
            raise OSError
        return files[name]

    assert list(programs_with("b.inc", list(files), read)) == ["second.tmc", "main.tmc"]
    assert list(programs_with("main.tmc", list(files), read)) == []


def test_the_file_of_parameter_names_defines_each_parameter_once():
    name, text = standard("tmclparam.tmc")
    assembly = assemble(text, name)
    assert assembly.diagnostics == ()
    values = [symbol.value for symbol in assembly.symbols.values() if symbol.name.startswith("AP")]
    assert values == [row.number for row in AXIS_PARAMETERS]
    assert standard("Interrupts.inc") is None
