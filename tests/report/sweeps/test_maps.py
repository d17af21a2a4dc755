"""Protects maps and curves of a sweep: every number is in the right cell, with its member."""

import statistics

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN, code
from support.sections import figures_in, sweep_sections

from rbstab.report.model.figure import Axis, Cells, Line, Points
from rbstab.report.model.palette import GOOD, OPEN
from rbstab.report.sweeps.maps.cells import cells_of, map_grid
from rbstab.report.sweeps.parameters import binned
from rbstab.report.sweeps.quantities import (
    MIN_SPREAD,
    MemberQuantity,
    settling_time,
    start_energy,
)

X, Y = "initial_angular_velocity_0", "initial_angular_velocity_1"
SAMPLED = {"body.mass": {"uniform": [1, 9]}, f"{SPIN}[0]": {"normal": [0, 1]}}
DESIGN = {"design": "random", "members": 3000, "seed": 3}
TIME = "settling time of v [s]"


def cells_in(panel):
    (cells,) = (mark for mark in panel.marks if isinstance(mark, Cells))
    return cells


def settling_map(made, vary, settling, **keys):
    """The map of settling times of a sweep in which they are a function of the columns."""
    sections = sweep_sections(made(vary, lambda a: {"settling_time": settling(a)}, **keys))
    (panel,) = figures_in(sections)["sweep-1-first"].panels
    assert panel.title == TIME
    return panel, cells_in(panel)


def test_rows_are_the_vertical_axis_and_ascend(made):
    # The values differ along both axes, so a turned or mirrored map would differ too.
    panel, cells = settling_map(made, GRID, lambda a: 100 * (a[X] + 2) + a[Y])
    assert panel.x.text == "initial angular_velocity[0] [rad/s]"
    assert panel.y.text == "initial angular_velocity[1] [rad/s]"
    assert cells.x.tolist() == [-2, -1, 0, 1, 2]
    assert cells.y.tolist() == [0, 10, 20, 30]
    assert cells.values.tolist() == [[100 * i + 10 * j for i in range(5)] for j in range(4)]
    # The second parameter changes fastest: member 4 i + j has the entries i and j.
    assert cells.members.shown.tolist() == [[4 * i + j for i in range(5)] for j in range(4)]
    assert (cells.members.counts == 1).all()
    assert (cells.members.gaps == -1).all()


def test_outcomes_are_words_and_stand_below_the_answer(made):
    def columns(a):
        return {
            "status": np.where(a[X] > 0, code("range left"), 0),
            "settling_time": np.where(a[Y] > 5, np.nan, 1.0),
            "smallest_regularity": a[Y] + 1,
            "final_orientation": np.radians(np.outer(2 * a[Y], [0, 1, 0])),
        }

    sweep = made(GRID, columns)
    (sweep.path.parent / "plan.yaml").write_text("")
    sections = sweep_sections(sweep)
    first, others = (figures_in(sections)[f"sweep-1-{name}"] for name in ("first", "map"))
    assert [panel.title for panel in first.panels] == ["outcome", "final tilt [°]"]
    assert [panel.title for panel in others.panels] == ["smallest cos θ2"]
    assert next(block for block in sections[0].blocks if not isinstance(block, str)) is first
    assert first.command == f"rbstab run {sweep.path.parent / 'plan.yaml'} --member"
    cells = cells_in(first.panels[0])
    assert cells.scale.categories == ("returns", "still moving", "left the range")
    row = [1.0, 1.0, 1.0, 2.0, 2.0]
    assert cells.values.tolist() == [[0.0, 0.0, 0.0, 2.0, 2.0], row, row, row]
    tilts = cells_in(first.panels[1]).values
    assert tilts[0].tolist() == pytest.approx([0.0] * 5)
    assert tilts[1].tolist() == pytest.approx([20.0] * 5)


def test_a_cell_without_a_value_says_why(made):
    def columns(a):
        left, diverged = code("range left"), code("diverged")
        return {
            "status": np.select([a[X] == 2, a[X] == 1], [left, diverged], 0),
            "settling_time": np.where(a[X] == 0, np.nan, 1.0 + a[Y]),
        }

    figure = figures_in(sweep_sections(made(GRID, columns)))["sweep-1-first"]
    (cells,) = (cells_in(panel) for panel in figure.panels if panel.title == TIME)
    words = np.array([*cells.members.reasons, ""])[cells.members.gaps]
    assert words.tolist() == [["", "", "still moving", "failed", "left the range"]] * 4
    assert np.isnan(cells.values[:, 2:]).all()


def test_a_third_axis_is_cut_into_slices(made):
    vary = GRID | {"controller.K_r": {"scale": {"geomspace": [0.01, 1, 3]}}}
    sweep = made(vary, lambda a: {"settling_time": a[X] + a[Y] * a["controller_K_r"] + 3})
    figure = figures_in(sweep_sections(sweep))["sweep-1-map-settling-time"]
    titles = [f"K_r[0] (with all of K_r) = {f}" for f in (4, 40, 400)]
    assert [p.title for p in figure.panels] == titles
    for panel, factor in zip(figure.panels, (0.01, 0.1, 1.0), strict=True):
        cells = cells_in(panel)
        expected = cells.x[np.newaxis] + cells.y[:, np.newaxis] * factor + 3
        assert cells.values == pytest.approx(expected)
        # All slices share one scale, from the smallest to the largest number of all.
        assert cells.span == pytest.approx((1.0, 35.0))


def test_variants_have_maps_of_their_own_on_one_scale(made):
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    sweep = made(vary, lambda a: {"settling_time": a[Y] + 100 * a["controller_variant"]})
    figure = figures_in(sweep_sections(sweep))["sweep-1-map-settling-time"]
    free, tied = figure.panels
    assert (free.title, tied.title) == ("free", "visco-elastic")
    assert cells_in(free).values[:, 0].tolist() == [0, 10, 20, 30]
    assert cells_in(tied).values[:, 0].tolist() == [100, 110, 120, 130]
    assert figure.shared == "xy"
    assert figure.shares_scale


def test_cells_hold_medians_and_shares(members):
    """The member nearest to the median stands for a cell; one without a value says why."""

    def columns(a):
        return {"settling_time": np.where(a["run"] % 3, np.sin(a["run"]), np.nan)}

    swept = members(SAMPLED, columns, **DESIGN)
    x, y = (binned(p, n) for p, n in zip(swept.parameters, (3, 9), strict=True))
    grid = map_grid(x, y)
    cells = cells_of(swept, grid, settling_time(swept))
    has = MemberQuantity("big", Axis("big"), 1.0 * (np.sin(np.arange(3000)) > 0.5), is_share=True)
    shares = cells_of(swept, grid, has)
    assert cells.members is not None
    assert shares.span == (0, 1)
    assert cells.members.counts.sum() == 3000
    kinds = set()
    for row in range(9):
        for column in range(3):
            in_cell = np.flatnonzero((y.indices == row) & (x.indices == column))
            shown, gap = cells.members.shown[row, column], cells.members.gaps[row, column]
            value = cells.values[row, column]
            assert cells.members.counts[row, column] == len(in_cell)
            if not len(in_cell):
                kinds.add("empty")
                assert (shown, gap) == (-1, -1)
                continue
            values = swept.column("settling_time")[in_cell]
            if np.isnan(value):
                few = len(in_cell) < 5
                kinds.add("few" if few else "gap")
                word = "fewer than 5 members" if few else "still moving"
                assert shown in in_cell
                assert cells.members.reasons[gap] == word
            else:
                kinds.add("value")
                assert value == pytest.approx(statistics.median(values[~np.isnan(values)]))
                assert shown == in_cell[np.nanargmin(np.abs(values - value))]
                assert gap == -1
            expected = (np.sin(in_cell) > 0.5).mean() if len(in_cell) >= 5 else np.nan
            assert shares.values[row, column] == pytest.approx(expected, nan_ok=True)
    assert {"few", "value"} <= kinds


def test_few_drawn_members_are_points(made):
    sweep = made(
        SAMPLED,
        lambda a: {"settling_time": np.where(a[X] > 0, 1, np.nan)},
        **DESIGN | {"members": 40},
    )
    (panel,) = figures_in(sweep_sections(sweep))["sweep-1-first"].panels
    settled, unsettled = panel.marks
    assert isinstance(settled, Points)
    assert isinstance(unsettled, Points)
    across = {panel.x.label: "x", panel.y.label: "y"}["initial angular_velocity[0]"]
    assert (getattr(settled, across) > 0).all()
    assert (getattr(unsettled, across) <= 0).all()
    assert len(settled.x) + len(unsettled.x) == 40
    assert settled.texts[0].endswith(f"member {settled.members[0]}")


def test_curves_along_a_single_axis(made):
    def columns(a):
        return {"settling_time": np.where(a["controller_K_r"] > 50, np.nan, a["controller_K_r"])}

    vary = {"controller.K_r": {"scale": {"geomspace": [100, 0.01, 5]}}}
    figures = figures_in(sweep_sections(made(vary, columns)))
    outcome, settling = figures["sweep-1-first"].panels
    assert outcome.y.categories == ("returns", "still moving")
    returning, moving = outcome.marks
    assert isinstance(returning, Points)
    assert isinstance(moving, Points)
    assert (returning.y.tolist(), moving.y.tolist()) == ([0, 0, 0, 0], [1])
    assert (returning.colour, moving.colour) == (GOOD, OPEN)
    assert settling.x.log
    (line,) = settling.marks
    assert isinstance(line, Line)
    assert line.x == pytest.approx([4, 40, 400, 4000, 40_000])
    assert line.y[:4] == pytest.approx([0.01, 0.1, 1, 10])
    assert np.isnan(line.y[4])


@pytest.mark.parametrize(("spread", "is_drawn"), [(0.9, False), (1.1, True)])
def test_values_that_hardly_differ_have_no_map(made, spread, is_drawn):
    def columns(a):
        return {"settling_time": 0.0756 * (1 - MIN_SPREAD * spread * a["run"] / 19)}

    assert ("sweep-1-first" in figures_in(sweep_sections(made(GRID, columns)))) is is_drawn


@pytest.mark.parametrize(("size", "is_drawn"), [(4.0, False), (0.4, True)])
def test_a_map_whose_cells_spread_more_than_they_differ_is_left_out(made, size, is_drawn):
    """Noise of the same size as the trend leaves 7 % explained; a tenth of it leaves 88 %."""
    noise = np.random.default_rng(1).uniform(-1, 1, 3000)

    def columns(a):
        return {"settling_time": 20 + a["body_mass"] / 8 + size * noise}

    figures = figures_in(sweep_sections(made(SAMPLED, columns, **DESIGN)))
    assert ("sweep-1-first" in figures) is is_drawn


def test_the_round_off_of_a_start_at_rest_is_no_energy(members):
    """Driven members start at rest: v(0) is zero up to round-off, and the energy some J."""
    noise = np.where(np.arange(20) % 2, 1e-19, -3e-20)
    swept = members(GRID, lambda _: {"lyapunov_start": noise})
    assert not start_energy(swept).values.any()
