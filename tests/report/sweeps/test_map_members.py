"""Protects what a map says of its cells: the member, why there is no value, extremes, colours."""

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN, code
from support.sections import figures_in, sweep_sections

from rbstab.report.model.figure import Cells, Points
from rbstab.report.sweeps.maps.cell_grid import map_grid
from rbstab.report.sweeps.maps.cell_values import quantity_cells, shares
from rbstab.report.sweeps.maps.colour_ranges import ONE_COLOUR, on_one_scale
from rbstab.report.sweeps.parameters import binned
from rbstab.report.sweeps.quantities import settling_time

X, Y = "initial_angular_velocity_0", "initial_angular_velocity_1"

SAMPLED = {"body.mass": {"uniform": [1, 9]}, f"{SPIN}[0]": {"normal": [0, 1]}}
DESIGN = {"design": "random", "members": 3000, "seed": 3}


def panel_of(sections, title, name="sweep-1-map"):
    (panel,) = (p for p in figures_in(sections)[name].panels if p.title == title)
    (cells,) = (mark for mark in panel.marks if isinstance(mark, Cells))
    return panel, cells


def test_a_cell_of_a_grid_has_its_member(made):
    # The second parameter changes fastest: member 4 i + j has the entries i and j.
    _, cells = panel_of(
        sweep_sections(made(GRID, lambda a: {"settling_time": a["run"] + 1})),
        "settling time of v [s]",
    )
    assert cells.members.shown.tolist() == [[4 * i + j for i in range(5)] for j in range(4)]
    assert (cells.members.counts == 1).all()
    assert (cells.members.gaps == -1).all()


def test_a_cell_without_a_value_says_why(made):
    def columns(a):
        return {
            "status": np.where(
                a[X] == 2, code("range left"), np.where(a[X] == 1, code("diverged"), 0)
            ),
            "settling_time": np.where(a[X] == 0, np.nan, 1.0 + a[Y]),
        }

    _, cells = panel_of(sweep_sections(made(GRID, columns)), "settling time of v [s]")
    words = np.array([*cells.members.reasons, ""])[cells.members.gaps]
    expected = ["", "", "still moving", "failed", "left the range"]
    assert words.tolist() == [expected] * 4


def test_the_member_nearest_to_the_median_stands_for_a_cell(members):
    def columns(a):
        return {"settling_time": np.where(a["run"] % 3, np.sin(a["run"]), np.nan)}

    found = members(SAMPLED, columns, **DESIGN)
    x, y = (binned(p, n) for p, n in zip(found.parameters, (3, 9), strict=True))
    grid = map_grid(x, y)
    cells = quantity_cells(found, grid, settling_time(found))
    assert cells.members is not None
    assert cells.members.counts.sum() == 3000
    few, none = 0, 0
    for row in range(9):
        for column in range(3):
            own = np.flatnonzero((y.indices == row) & (x.indices == column))
            shown, gap = cells.members.shown[row, column], cells.members.gaps[row, column]
            assert cells.members.counts[row, column] == len(own)
            if not len(own):
                none += 1
                assert (shown, gap) == (-1, -1)
            elif np.isnan(cells.values[row, column]):
                few += 1
                word = "fewer than 5 members" if len(own) < 5 else "still moving"
                assert shown in own
                assert cells.members.reasons[gap] == word
            else:
                values = found.column("settling_time")[own]
                distance = np.abs(values - cells.values[row, column])
                assert shown == own[np.nanargmin(distance)]
                assert gap == -1
    assert few > 0


def test_members_that_failed_have_a_cross(made):
    """One of many cells is a few pixels."""

    def columns(a):
        failed = (a[X] == 0) & (a[Y] == 10)
        return {"settling_time": 5 + a[X], "status": np.where(failed, code("diverged"), 0)}

    panel, _ = panel_of(sweep_sections(made(GRID, columns)), "settling time of v [s]")
    (cross,) = (m for m in panel.marks if isinstance(m, Points) and m.label == "failed")
    assert (cross.x.tolist(), cross.y.tolist(), cross.symbol) == ([0], [10], 1)


def test_extremes_are_marked_where_they_are(made):
    def columns(a):
        return {"settling_time": 5 + a[X] - 0.01 * a[Y]}

    panel, _ = panel_of(sweep_sections(made(GRID, columns)), "settling time of v [s]")
    smallest, largest = (mark for mark in panel.marks if isinstance(mark, Points))
    assert (smallest.x.tolist(), smallest.y.tolist()) == ([-2], [30])
    assert (largest.x.tolist(), largest.y.tolist()) == ([2], [0])
    assert (smallest.members, largest.members) == ((3,), (16,))
    assert largest.texts == (
        "largest value: 7 s\ninitial angular_velocity[0] = 2 rad/s\n"
        "initial angular_velocity[1] = 0 rad/s\nmember 16",
    )


def test_an_extreme_that_several_cells_share_is_not_marked(made):
    """The smallest value depends on X alone, apart from round-off; one cell has the largest."""

    def columns(a):
        alone = (a[X] == 2) & (a[Y] == 30)
        return {"settling_time": (5 + a[X] + 0.5 * alone) * (1 + 1e-15 * a[Y])}

    panel, _ = panel_of(sweep_sections(made(GRID, columns)), "settling time of v [s]")
    marks = [mark for mark in panel.marks if isinstance(mark, Points)]
    assert [(mark.label, mark.x.tolist(), mark.y.tolist()) for mark in marks] == [
        ("largest value", [2], [30])
    ]


@pytest.mark.parametrize(("spread", "is_one"), [(0.9, True), (1.1, False)])
def test_values_that_hardly_differ_have_one_colour(made, spread, is_one):
    """At 0.9 % apart the colours differ by less than 1 % of the scale, at 1.1 % they fill it."""

    def columns(a):
        return {"settling_time": 0.0756 * (1 - ONE_COLOUR * spread * a["run"] / 19)}

    sections = sweep_sections(made(GRID, columns))
    panel, cells = panel_of(sections, "settling time of v [s]")
    caption = figures_in(sections)["sweep-1-map"].caption
    used = np.ptp(cells.values) / (np.ptp(cells.span) if cells.span else np.inf)
    assert ("less than 1% apart" in caption) == is_one
    assert any(isinstance(mark, Points) for mark in panel.marks) != is_one
    assert used < 0.02 if is_one else used == pytest.approx(1)


def test_shares_keep_their_scale(made):
    sweep = made(SAMPLED, lambda a: {"settling_time": np.where(a[X] > 0, 1, np.nan)}, **DESIGN)
    _, cells = panel_of(sweep_sections(sweep), "share: returns", "sweep-1-first")
    assert cells.span == (0, 1)
    (same,) = on_one_scale([cells])
    assert same is cells


def test_maps_by_condition_share_axes_and_one_scale(made):
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    sweep = made(vary, lambda a: {"settling_time": a[Y] + 100 * a["controller_variant"] + 1})
    figures = figures_in(sweep_sections(sweep))
    figure = figures["sweep-1-map-settling-time"]
    assert figure.shared == "xy"
    assert figure.shares_scale
    # v(0) of different conditions is not compared.
    assert "sweep-1-map-start-energy" not in figures


def test_the_command_of_a_member_is_that_of_its_plan(made):
    sweep = made(GRID, lambda a: {"settling_time": a["run"] + 1})
    (sweep.path.parent / "plan.yaml").write_text("")
    figure = figures_in(sweep_sections(sweep))["sweep-1-map"]
    assert figure.command == f"rbstab run {sweep.path.parent / 'plan.yaml'} --member"


def test_a_map_whose_cells_spread_more_than_they_differ_is_left_out(made):
    """Noise of the same size as the trend leaves 7 % explained; a tenth of it leaves 88 %."""
    rng = np.random.default_rng(1)
    noise = rng.uniform(-1, 1, 3000)
    for size, is_drawn in ((4.0, False), (0.4, True)):
        sweep = made(
            SAMPLED,
            lambda a, s=size: {"settling_time": 20 + a["body_mass"] / 8 + s * noise},
            **DESIGN,
        )
        sections = sweep_sections(sweep)
        texts = [b for s in sections for b in s.blocks if isinstance(b, str)]
        figures = figures_in(sections)
        titles = (
            [p.title for p in figures["sweep-1-map"].panels] if "sweep-1-map" in figures else []
        )
        assert ("settling time of v [s]" in titles) == is_drawn
        assert any("left out" in t and "settling time of v" in t for t in texts) != is_drawn


def test_a_share_counts_all_members_of_a_cell(members):
    found = members(SAMPLED, **DESIGN)
    x, y = (binned(p, 2) for p in found.parameters)
    grid = map_grid(x, y)
    assert np.nanmax(shares(grid, found.column("run") >= 0)) == 1
