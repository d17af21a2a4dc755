"""Protects the comparison of variants: side by side, and in pairs of members with equal values."""

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN
from support.sections import figures_in, sweep_sections, tables, texts

from rbstab.report.model.figure import Intervals
from rbstab.report.sweeps.conditions.paired_conditions import paired_conditions_of

VARIANTS = ["visco-elastic", "free", "permanent"]
EACH = {
    "controller.variant": {"each": {"values": VARIANTS}},
    f"{SPIN}[0]": {"normal": [0, 6]},
    "body.mass": {"uniform": [1, 2]},
}
DRAWN = {"design": "random", "members": 50, "seed": 4}


def columns(a):
    """Each variant settles 0.5 s later than the previous one; 10 members of the last one settle."""
    variant, point = a["controller_variant"], a["run"] % 50
    settling = a["body_mass"] + 0.5 * variant
    settling[(variant == 2) & (point >= 10)] = np.nan
    return {"settling_time": settling}


def groups_of(found):
    groups = paired_conditions_of(found)
    assert groups is not None
    assert groups.pairs is not None
    return groups


def test_the_same_members_are_compared_in_pairs(made):
    table = tables(sweep_sections(made(EACH, columns, **DRAWN)))["sweep-1-pairs"]
    rows = {(row[0].text, row[1].text): row for row in table.rows}
    second = rows["settling time of v [s]", "free minus visco-elastic"]
    assert [c.value for c in second[2:]] == pytest.approx([0.5, 0.5, 0.5, 0, 50])
    third = rows["settling time of v [s]", "permanent minus visco-elastic"]
    assert [c.value for c in third[2:]] == pytest.approx([1, 1, 1, 0, 10])


def test_pairs_have_the_same_values(members):
    found = members(EACH, **DRAWN)
    groups = groups_of(found)
    assert groups.labels == tuple(VARIANTS)
    assert groups.pairs.shape == (50, 3)
    for name in ("body_mass", "initial_angular_velocity_0"):
        values = found.column(name)[groups.pairs]
        assert (values == values[:, :1]).all()
    assert (groups.codes[groups.pairs] == [0, 1, 2]).all()


def test_pairs_of_a_grid(members):
    found = members(GRID | {"controller.variant": {"values": ["free", "visco-elastic"]}})
    groups = groups_of(found)
    assert groups.pairs.shape == (20, 2)
    for name in ("initial_angular_velocity_0", "initial_angular_velocity_1"):
        values = found.column(name)[groups.pairs]
        assert (values[:, 0] == values[:, 1]).all()
    assert (groups.codes[groups.pairs] == [0, 1]).all()


def test_outcomes_and_quantiles_by_variant(made):
    sections = sweep_sections(made(EACH, columns, **DRAWN))
    outcomes = tables(sections)["sweep-1-compared"]
    # What decides comes first: a narrow page shows only the first columns.
    assert outcomes.heads[1].label == "share settled"
    assert [[row[0], row[1], *row[4:]] for row in texts(outcomes)] == [
        ["visco-elastic", "1", "50", "0", "50"],
        ["free", "1", "50", "0", "50"],
        ["permanent", "0.2", "10", "40", "50"],
    ]
    share, *_ = figures_in(sections)["sweep-1-side-by-side"].panels
    assert share.x.categories == tuple(VARIANTS)
    mark = share.marks[0]
    assert isinstance(mark, Intervals)
    assert mark.y.tolist() == [1, 1, 0.2]
    quantiles = tables(sections)["sweep-1-compared-quantiles"]
    rows = {row[0].text: row for row in quantiles.rows}
    assert (quantiles.heads[1].label, quantiles.heads[1].unit) == ("settling time of v", "s")
    later, earlier = rows["free"][1].value, rows["visco-elastic"][1].value
    assert later is not None
    assert earlier is not None
    assert later - earlier == pytest.approx(0.5)
    # Ten of its fifty members are at rest by the end, so its median is later.
    assert rows["permanent"][1].text.startswith("later (")
    assert rows["permanent"][1].text.endswith(" to later)")
    assert "count as later than" in quantiles.note


def test_a_number_of_each_point_is_a_condition_too(members):
    vary = EACH | {"body.mass": {"each": {"values": [1, 2]}}}
    groups = groups_of(members(vary, **DRAWN))
    assert groups.labels[:3] == (
        "visco-elastic, mass = 1",
        "visco-elastic, mass = 2",
        "free, mass = 1",
    )
    assert groups.pairs.shape == (50, 6)


def test_drawn_variants_are_compared_but_not_in_pairs(made):
    vary = EACH | {"controller.variant": {"values": VARIANTS}}
    sections = sweep_sections(made(vary, **DRAWN | {"members": 300}))
    assert "sweep-1-pairs" not in tables(sections)
    counts = [int(row[-1]) for row in texts(tables(sections)["sweep-1-compared"])]
    assert sum(counts) == 300
    assert min(counts) > 60


def test_without_conditions_nothing_is_compared(made):
    assert not any("compared" in name for name in tables(sweep_sections(made(GRID))))
