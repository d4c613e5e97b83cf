"""Measured curves as CSV: written and read again, and every error with its line."""

from pathlib import Path

import numpy as np
import pytest

from analysis.gap.structures.curve import Curve
from jointlab.errors import JointlabError
from jointlab.structures.curve_file import read_curves
from tests.jointlab.structures.curves import write_curves


def test_curves_are_read_as_they_were_written(tmp_path: Path) -> None:
    conditions = {"frequency": np.array([10.0, 20.0])}
    first = Curve("stiffness", "cold", np.array([1 + 2j, 3.5 - 4j]), np.array([0.1, np.inf]), conditions)
    warm = {"frequency": np.ones(1), "temperature": np.array([40.0])}
    second = Curve("stiffness", "warm", np.array([5 + 0j]), np.array([0.2]), warm)
    write_curves(tmp_path / "curves.csv", [first, second])
    found = read_curves(tmp_path / "curves.csv")
    assert [(each.part, each.observable, sorted(each.conditions)) for each in found] == [
        ("cold", "stiffness", ["frequency"]),
        ("warm", "stiffness", ["frequency", "temperature"]),
    ]
    np.testing.assert_array_equal(found[0].values, first.values)
    np.testing.assert_array_equal(found[0].deviation, first.deviation)


def test_blanks_beside_commas_are_no_part_of_names_and_texts(tmp_path: Path) -> None:
    file = tmp_path / "curves.csv"
    file.write_text(
        'part, observable , value, deviation, frequency\nlevel 1, "receptance(a,b)" , 2, 0.1, 10 \n  \n'
        'level 1 ,"receptance(a,b)",3,0.1,20\n',
        encoding="utf-8",
    )
    (found,) = read_curves(file)
    assert (found.part, found.observable) == ("level 1", "receptance(a,b)")
    assert found.values.tolist() == [2.0, 3.0]
    assert found.conditions["frequency"].tolist() == [10.0, 20.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("part,value,deviation\na,1,1\n", "no column 'observable'"),
        ("part,observable,value,deviation\n", "no values"),
        ("part,observable,value,deviation,frequency\na,f,1,1,1\na,f,x,1,2\n", "line 3: value is 'x', not a number"),
        ("part,observable,value,deviation,frequency\na,f,1,1,1\na,f,1,1,\n", "line 3: frequency is '', not a number"),
        ("part,observable,value,deviation,frequency\na,f,1,1,\na,f,1,1,2\n", "line 2: frequency is '', not a number"),
        (
            "part,observable,value,deviation\nb,f,1,1\na,f,1,1\na,f,1,0\n",
            "line 4: f of part 'a': a deviation is not above",
        ),
        ("part,observable,value,deviation\na,f,1,nan\n", "line 2: f of part 'a': a deviation is not above"),
        (
            "part,observable,value,deviation\na,f,1,0\na,f,nan,1\n",
            "line 3: f of part 'a': the values are not all finite",
        ),
        ("part,observable,value,deviation,x\na,f,1,1,1\na,f,1,1,inf\n", "line 3: f of part 'a': x are not all finite"),
        ("part;observable;value;deviation\na;f;1;1\n", "has ';' between its cells; write commas there"),
        ("part;observable;value;deviation\na;f;1,5;0,1\n", "has ';' between its cells; write commas there"),
        ("part\tobservable\tvalue\tdeviation\na\tf\t1\t1\n", r"has '\\t' between its cells"),
        ("part,observable,value,deviation\na,f,1_000,1\n", "line 2: value is '1_000', not a number"),
        # a decimal comma would shift every number by a column: 1,5 read as a value of 1 with a deviation of 5
        ("part,observable,value,deviation,frequency\na,f,1,1,1\na,f,1,5,0,2,10\n", "line 3 has 7 cells, and not 5"),
        ("part,observable,value,deviation,frequency\na,f\n", "line 2 has 2 cells, and not 5"),
        ("part,observable,value,deviation,frequency,frequency\na,f,1,1,1,2\n", "two columns 'frequency'"),
        ("part,observable,value,deviation\n\n\na,f,x,1\n", "line 4: value is 'x', not a number"),
        (f"part,observable,value,deviation\na,{'f' * 200_000},1,1\n", "line 2: field larger than field limit"),
    ],
)
def test_a_table_that_is_wrong_is_refused_with_what_is_wrong(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "curves.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(JointlabError, match=said):
        read_curves(file)


def test_a_file_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    with pytest.raises(JointlabError, match="cannot be read"):
        read_curves(tmp_path / "none.csv")
