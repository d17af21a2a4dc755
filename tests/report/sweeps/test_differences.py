"""Protects the comparison of conditions in pairs of members that differ in nothing else."""

from typing import Any

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN
from support.sections import sweep_sections, tables

from rbstab.report.sweeps.conditions.paired_conditions import conditions_of

VARIANTS = ["visco-elastic", "free", "permanent"]
EACH = {
    "controller.variant": {"each": {"values": VARIANTS}},
    f"{SPIN}[0]": {"normal": [0, 6]},
    "body.mass": {"uniform": [1, 2]},
}
DRAWN = {"design": "random", "members": 50, "seed": 4}


def differences(made, column, values, **keys):
    """Return the rows on a column that is a function of the point, by variant; and the note."""

    def columns(a):
        point = a["run"] % 50
        numbers = np.choose(a["controller_variant"], [function(point) for function in values])
        is_vector = column == "peak_contact_displacement"
        return {column: np.outer(numbers, np.ones(3)) if is_vector else numbers}

    table = tables(sweep_sections(made(EACH, columns, **(DRAWN | keys))))["sweep-1-pairs"]
    names = {
        "settling_time": "settling time of v [s]",
        "smallest_regularity": "smallest cos θ2",
        "peak_contact_displacement": "largest |E1|, |E2| or |E3| [m]",
    }
    return {row[1].text: row[2:] for row in table.rows if row[0].text == names[column]}, table


def test_the_columns_of_differences(made):
    """Each settles 0.5 s later than the one before; of the last, 40 are not at rest by the end."""
    values = (
        lambda p: 1.0 + 0.01 * p,
        lambda p: 1.5 + 0.01 * p,
        lambda p: np.where(p >= 10, np.nan, 2.0 + 0.01 * p),
    )
    rows, table = differences(made, "settling_time", values)
    # No column of quantiles can be taken for an interval of confidence.
    assert [head.label for head in table.heads] == [
        *("quantity", "difference", "smaller with", "median", "95% interval of the median"),
        *("5% of the pairs below", "95% of the pairs below", "share of the pairs above 0"),
        *("pairs", "equal pairs"),
    ]
    second, third = rows["free minus visco-elastic"], rows["permanent minus visco-elastic"]
    assert [second[k].value for k in (1, 3, 4, 5, 6, 7)] == pytest.approx([0.5, 0.5, 0.5, 1, 50, 0])
    assert [second[k].text for k in (0, 2)] == ["visco-elastic", "0.5 to 0.5"]
    assert [third[k].text for k in (0, 1, 4)] == ["visco-elastic", "later", "later"]
    assert [third[k].value for k in (3, 5, 6, 7)] == pytest.approx([1, 1, 50, 0])


def test_a_larger_smallest_cosine_is_better(made):
    values = [lambda p, k=k: 0.2 + 0.3 * k + 0.001 * p for k in range(3)]
    rows, table = differences(made, "smallest_regularity", values)
    medians = {name: row[1].value for name, row in rows.items()}
    assert medians == pytest.approx(
        {"visco-elastic minus permanent": -0.6, "free minus permanent": -0.3}
    )
    assert "(larger is better): permanent" in table.note


def test_the_table_says_why_no_condition_is_named(made):
    values = (lambda p: 3.0 + 0.0 * p, lambda p: 3.01 + 0.0 * p, lambda p: 3.0 + 1.0 * (p < 9))
    rows, _ = differences(made, "settling_time", values)
    assert {name: row[0].text for name, row in rows.items()} == {
        "free minus visco-elastic": "none: less than 1%",
        "permanent minus visco-elastic": "equal in most pairs",
    }
    chance = (lambda p: 3.0 + 0.0 * p, lambda p: 3.0 + 0.1 * (-1.0) ** p, lambda p: 9.0 + 0.0 * p)
    rows, _ = differences(made, "settling_time", chance)
    assert "no sure difference" in {row[0].text for row in rows.values()}


def test_a_condition_that_holds_the_contact_point_is_left_out(made):
    values = [lambda p, k=k: k * (1.0 + 0.01 * p) for k in (0.3, 0.2, 0.0)]
    rows, table = differences(made, "peak_contact_displacement", values)
    assert list(rows) == ["visco-elastic minus free"]
    always = "Always 0 with permanent, by construction: largest |E1|, |E2| or |E3|."
    assert always in table.note


@pytest.mark.parametrize(
    ("vary", "keys", "labels", "pairs"),
    [
        (EACH, DRAWN, tuple(VARIANTS), (50, 3)),
        (
            EACH | {"body.mass": {"each": {"values": [1, 2]}}},
            DRAWN,
            tuple(f"{name}, mass = {m} kg" for name in VARIANTS for m in (1, 2)),
            (50, 6),
        ),
        (
            GRID | {"controller.variant": {"values": VARIANTS[:2]}},
            {},
            tuple(VARIANTS[:2]),
            (20, 2),
        ),
    ],
    ids=["each", "two", "grid"],
)
def test_pairs_have_the_same_values(members, vary, keys, labels, pairs):
    swept = members(vary, **keys)
    groups: Any = conditions_of(swept)
    assert groups.labels == labels
    assert groups.pairs.shape == pairs
    values = swept.column("initial_angular_velocity_0")[groups.pairs]
    assert (values == values[:, :1]).all()
    for k, part in enumerate(groups.slices):
        assert set(groups.pairs[:, k]) == set(part.chosen)


@pytest.mark.parametrize(("key", "expected"), [("body.mass", True), (f"{SPIN}[1]", False)])
def test_conditions_may_have_a_function_v_of_their_own(members, key, expected):
    vary = {key: {"each": {"values": [1, 2]}}, f"{SPIN}[0]": {"normal": [0, 6]}}
    groups: Any = conditions_of(members(vary, design="random", members=10, seed=4))
    assert groups.v_differs is expected
