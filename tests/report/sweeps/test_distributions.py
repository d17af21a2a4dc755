"""Protects the histograms and quantiles of a sweep against numbers that can be counted by hand."""

import numpy as np
import pytest
from support.made_sweeps import code
from support.sections import figures_in, sweep_sections, tables

from rbstab.report.model.figure import Bars, Line
from rbstab.report.sweeps.distributions import MAX_CURVES, histogram, quantiles_of

VARY = {"body.mass": {"linspace": [1, 101, 101]}}


def columns(a):
    settling = a["run"].astype(float)
    settling[100] = np.inf
    status = np.where(a["run"] == 0, code("step limit"), 0)
    residual = 10.0 ** -(a["run"] % 5)
    return {"settling_time": settling, "status": status, "energy_residual": residual}


def test_quantiles_are_those_of_members_that_have_a_number(made):
    table = tables(sweep_sections(made(VARY, columns)))["sweep-1-quantiles"]
    (row,) = (row for row in table.rows if row[0].text == "settling time of v")
    heads = [head.label for head in table.heads[2:]]
    assert heads == ["median", "5%", "95%", "minimum", "maximum", "members"]
    # The first member failed. The last is not at rest by the end: it is later than all others.
    assert [cell.value for cell in row[2:6]] == [50, 5, 95, 1]
    assert [cell.text for cell in row[6:]] == ["later", "100"]


EACH = {
    "controller.variant": {"each": {"values": ["visco-elastic", "free"]}},
    "body.mass": {"uniform": [1, 2]},
}
DRAWN = {"design": "random", "members": 100, "seed": 4}


def settled_by_variant(a):
    """Member k of a variant settles after k + 1 s, with `free` 100 s later; the last 20 do not."""
    point = a["run"] % 100
    settling = point + 1.0 + 100.0 * a["controller_variant"]
    return {
        "settling_time": np.where((a["controller_variant"] == 1) & (point >= 80), np.nan, settling)
    }


def test_each_condition_has_a_curve_and_nothing_is_pooled(made):
    found = sweep_sections(made(EACH, settled_by_variant, **DRAWN))
    assert "sweep-1-histograms" not in figures_in(found)
    assert "sweep-1-quantiles" not in tables(found)
    panels = {panel.x.label: panel for panel in figures_in(found)["sweep-1-cumulative"].panels}
    first, second = panels["settling time of v"].marks
    assert isinstance(first, Line)
    assert isinstance(second, Line)
    assert (first.label, second.label) == ("visco-elastic", "free")
    # Of 100 members, exactly k are at rest by k seconds.
    at = np.array([1.0, 25.0, 50.0, 75.0, 100.0])
    shares = [first.y[first.x <= t].max() for t in at]
    assert shares == pytest.approx(at / 100)
    # The last 20 of the other variant have no value: its curve ends at 0.8.
    assert (second.x.min(), second.x.max(), second.y.max()) == (101.0, 180.0, 0.8)


def test_too_many_conditions_are_named(made):
    each = {"body.mass": {"each": {"values": [float(k) for k in range(1, MAX_CURVES + 2)]}}}
    spin = {"initial.angular_velocity[0]": {"normal": [0, 6]}}
    sections = sweep_sections(
        made(each | spin, lambda a: {"settling_time": a["run"] + 1.0}, **(DRAWN | {"members": 5}))
    )
    assert not [name for name in figures_in(sections) if "cumulative" in name]
    said = [block for section in sections for block in section.blocks if isinstance(block, str)]
    assert any(text.startswith(f"{MAX_CURVES + 1} conditions") for text in said)


def test_every_number_is_in_one_bar(made):
    panels = figures_in(sweep_sections(made(VARY, columns)))["sweep-1-histograms"].panels
    found = {panel.x.label: panel for panel in panels}
    assert set(found) == {"settling time of v", "max |r| / largest energy"}
    for panel, count in zip(found.values(), (99, 100), strict=True):
        (bars,) = panel.marks
        assert isinstance(bars, Bars)
        assert bars.heights.sum() == count
    (bars,) = found["max |r| / largest energy"].marks
    assert isinstance(bars, Bars)
    assert found["max |r| / largest energy"].x.log
    # The edges have equal ratios.
    assert np.diff(np.log10(bars.edges)) == pytest.approx(np.log10(bars.edges[1] / bars.edges[0]))
    assert (bars.edges[0], bars.edges[-1]) == pytest.approx((1e-4, 1))


def test_peaks_are_sizes_so_that_they_leave_no_hole_around_zero(made):
    """A peak is the extreme with its sign: half of them to each side would be two groups."""

    def signed(a):
        side = np.where(a["run"] % 2 == 0, 1.0, -1.0)
        return {"peak_contact_displacement": np.outer(side * (1.0 + a["run"]), [0.01, 0.02, 0.03])}

    sections = sweep_sections(made(VARY, signed))
    panels = {p.x.label: p for p in figures_in(sections)["sweep-1-histograms"].panels}
    for k in (1, 2, 3):
        (bars,) = panels[f"largest |E{k}|"].marks
        assert isinstance(bars, Bars)
        assert (bars.edges[0], bars.edges[-1]) == pytest.approx((0.01 * k, 1.01 * k))
        assert (bars.heights > 0).all()
    (row,) = (r for r in tables(sections)["sweep-1-quantiles"].rows if r[0].text == "largest |E1|")
    assert row[2].value == pytest.approx(0.51)


def test_a_histogram_by_hand():
    values = np.array([0.0, 0.1, 1.9, 2.0, np.nan, 9.9, 10.0, np.inf] * 8)
    bars = histogram(values, log=False)
    width = bars.edges[1] - bars.edges[0]
    assert bars.edges[-1] == 10.0
    assert bars.heights[0] == 8 * sum(v < width for v in (0.0, 0.1, 1.9, 2.0))
    assert histogram(values, log=True).heights.sum() == 40


def test_quantiles_of_nothing():
    assert all(np.isnan(quantiles_of(np.array([np.nan, np.nan]))))


def test_later_values_are_the_largest_and_nothing_is_interpolated_to_them():
    values = np.array([np.inf, 3.0, np.nan, 1.0, np.inf, 2.0])
    assert quantiles_of(values, (0.0, 0.5, 0.6, 0.61, 1.0)) == [1.0, 3.0, 3.0, np.inf, np.inf]


@pytest.mark.parametrize("largest", [7, 40, 733])
def test_bars_of_whole_numbers_hold_equally_many_of_them(largest):
    """Otherwise some bars would hold one number more than others, and some none."""
    values = np.arange(1.0, largest + 1.0).repeat(9)
    bars = histogram(values, log=False)
    width = np.diff(bars.edges)
    assert (width == width[0]).all()
    assert width[0] == np.round(width[0])
    assert (bars.heights[:-1] == 9 * width[0]).all()
    assert bars.heights.sum() == len(values)
