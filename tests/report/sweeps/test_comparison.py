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
    heads = [head.label for head in table.heads]
    # No column of quantiles can be taken for an interval of confidence.
    assert heads == [
        *("quantity", "difference", "median", "95% interval of the median"),
        *("5% of the pairs below", "95% of the pairs below", "share of the pairs above 0"),
        *("pairs", "equal pairs"),
    ]
    second = rows["settling time of v [s]", "free minus visco-elastic"]
    assert [c.value for c in (second[2], *second[4:])] == pytest.approx([0.5, 0.5, 0.5, 1, 50, 0])
    assert second[3].text == "0.5 to 0.5"
    # Forty of its members are not at rest by the end: their differences are larger than any other.
    third = rows["settling time of v [s]", "permanent minus visco-elastic"]
    assert [third[2].text, third[5].text] == ["later", "later"]
    assert [c.value for c in (third[4], *third[6:])] == pytest.approx([1, 1, 50, 0])


def settling_by_variant(made, values, **keys):
    """The sections of a sweep whose settling times are functions of the point, by variant."""

    def columns(a):
        point = a["run"] % 50
        each = [own(point) for own in values]
        return {"settling_time": np.choose(a["controller_variant"], each)}

    return sweep_sections(made(EACH, columns, **(DRAWN | keys)))


def test_differences_are_from_the_best_condition(made):
    """The second variant is the best one: smaller in all pairs, by 0.1 to 5 and by 2."""
    values = (lambda p: 3.1 + 0.1 * p, lambda p: 3.0 + 0.0 * p, lambda p: 5.0 + 0.0 * p)
    table = tables(settling_by_variant(made, values))["sweep-1-pairs"]
    rows = {row[1].text: row for row in table.rows if row[0].text.startswith("settling")}
    assert list(rows) == ["visco-elastic minus free", "permanent minus free"]
    first = rows["visco-elastic minus free"]
    assert [first[k].value for k in (2, 4, 5)] == pytest.approx([2.55, 0.345, 4.755])
    # With 50 pairs, the 18th and the 33rd difference: those of the sign test.
    assert first[3].text == "1.8 to 3.3"
    assert "Best in settling time of v: free, as none is better." in table.note


def test_without_a_best_condition_differences_are_from_the_first(made):
    """Stone, paper and scissors."""
    values = [lambda p, k=k: 1.0 + (k + p % 3) % 3 for k in range(3)]
    table = tables(settling_by_variant(made, values))["sweep-1-pairs"]
    names = [row[1].text for row in table.rows if row[0].text.startswith("settling")]
    assert names == ["free minus visco-elastic", "permanent minus visco-elastic"]
    assert (
        "None is the best in settling time of v: the differences are from the first, visco-elastic."
    ) in table.note


def test_a_larger_smallest_cosine_is_better(made):
    def columns(a):
        return {"smallest_regularity": 0.2 + 0.3 * a["controller_variant"] + 0.001 * a["body_mass"]}

    table = tables(sweep_sections(made(EACH, columns, **DRAWN)))["sweep-1-pairs"]
    rows = [row for row in table.rows if row[0].text == "smallest cos θ2"]
    assert [row[1].text for row in rows] == [
        "visco-elastic minus permanent",
        "free minus permanent",
    ]
    assert [row[2].value for row in rows] == pytest.approx([-0.6, -0.3])
    assert "(larger is better): permanent" in table.note


def test_each_pair_stands_once_with_the_smaller_values_first(made):
    values = (lambda p: 3.1 + 0.1 * p, lambda p: 3.0 + 0.0 * p, lambda p: 5.0 + 0.0 * p)
    sections = settling_by_variant(made, values)
    table = tables(sections)["sweep-1-all-pairs-settling-time"]
    rows = {row[0].text: row for row in table.rows}
    # The median of the first one is 5.55, in 30 of 49 pairs above 5; they are equal in one.
    assert list(rows) == ["free, permanent", "free, visco-elastic", "permanent, visco-elastic"]
    assert [row[1].text for row in rows.values()] == ["free", "free", "no sure difference"]
    assert [row[1].tone for row in rows.values()] == ["good", "good", ""]
    third = rows["permanent, visco-elastic"]
    assert [third[k].value for k in (2, 4, 5, 6)] == pytest.approx([0.6, 30 / 49, 49, 1])
    low, high = map(float, third[3].text.split(" to "))
    assert low < 0.0
    assert high > 0.6


def test_a_matrix_has_all_pairs_at_one_glance(made):
    values = (lambda p: 3.1 + 0.1 * p, lambda p: 3.0 + 0.0 * p, lambda p: 5.0 + 0.0 * p)
    found = tables(settling_by_variant(made, values))
    table = found["sweep-1-matrix-settling-time"]
    # In the order of their medians: free 3, permanent 5, visco-elastic 5.55.
    assert [head.label for head in table.heads] == [
        *("row minus column", "permanent", "visco-elastic")
    ]
    first, second = table.rows
    assert [cell.text for cell in (first[0], *second[:2])] == ["free", "permanent", ""]
    assert [cell.value for cell in (*first[1:], second[2])] == pytest.approx([-2.0, -2.55, -0.6])
    # Of the last pair, no difference is sure.
    assert [cell.tone for cell in (*first[1:], second[2])] == ["good", "good", ""]
    two = EACH | {"controller.variant": {"each": {"values": VARIANTS[:2]}}}
    names = tables(sweep_sections(made(two, columns, **DRAWN)))
    assert "sweep-1-matrix-settling-time" not in names


def test_pairs_decide_which_condition_is_first_and_not_medians(made):
    """`free` has the larger median, but in 38 of 50 pairs it is smaller, by 0.1."""
    values = (
        lambda p: 1.0 + p,
        lambda p: 1.0 + p + np.where((p >= 20) & (p < 32), 8.0, -0.1),
        lambda p: 99.0 + p,
    )
    table = tables(settling_by_variant(made, values))["sweep-1-all-pairs-settling-time"]
    (row,) = (row for row in table.rows if "permanent" not in row[0].text)
    assert row[0].text == "free, visco-elastic"
    assert [row[k].value for k in (2, 4)] == pytest.approx([0.1, 38 / 50])


def test_a_table_of_pairs_says_why_no_condition_is_named(made):
    values = (lambda p: 3.0 + 0.0 * p, lambda p: 3.01 + 0.0 * p, lambda p: 3.0 + 1.0 * (p < 9))
    sections = settling_by_variant(made, values)
    table = tables(sections)["sweep-1-all-pairs-settling-time"]
    found = {row[0].text: row[1].text for row in table.rows}
    assert found["visco-elastic, free"] == "none: less than 1%"
    assert found["visco-elastic, permanent"] == "equal in most pairs"
    # Members of a grid are no sample: their medians have no intervals.
    heads = [head.label for head in table.heads]
    assert "95% interval of the median" in heads


def test_a_condition_that_holds_the_contact_point_is_left_out(made):
    def columns(a):
        peak = np.choose(a["controller_variant"], [0.3, 0.2, 0.0]) * a["body_mass"]
        return {"peak_contact_displacement": np.outer(peak, np.ones(3))}

    found = tables(sweep_sections(made(EACH, columns, **DRAWN)))
    (row,) = found["sweep-1-all-pairs-peak-displacement"].rows
    assert row[0].text == "free, visco-elastic"
    pairs = found["sweep-1-pairs"]
    differences = [row[1].text for row in pairs.rows if row[0].text.startswith("largest")]
    assert differences == ["visco-elastic minus free"]
    always = "Always 0 with permanent, by construction: largest |E1|, |E2| or |E3|."
    assert always in pairs.note
    assert always in found["sweep-1-all-pairs-peak-displacement"].note


def test_where_all_shares_are_equal_there_is_no_panel_of_them(made):
    sections = sweep_sections(made(EACH, lambda a: {"settling_time": a["body_mass"]}, **DRAWN))
    panels = figures_in(sections)["sweep-1-side-by-side"].panels
    assert not [panel for panel in panels if "share" in panel.y.label]


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
    assert outcomes.heads[1].label == "share: returns"
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
        "visco-elastic, mass = 1 kg",
        "visco-elastic, mass = 2 kg",
        "free, mass = 1 kg",
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
