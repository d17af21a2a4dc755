"""Protects the maps of a sweep: every number is in the right cell."""

import statistics

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN, code
from support.sections import figures_in, sweep_sections

from rbstab.report.model.figure import Cells, Line, Points
from rbstab.report.model.palette import GOOD, OPEN
from rbstab.report.sweeps.maps.cell_grid import map_grid
from rbstab.report.sweeps.maps.cell_values import contour_line, medians, shares
from rbstab.report.sweeps.parameters import binned
from rbstab.report.sweeps.quantities import start_energy

X, Y = "initial_angular_velocity_0", "initial_angular_velocity_1"


def cells_of(panel):
    (found,) = (mark for mark in panel.marks if isinstance(mark, Cells))
    return found


def test_rows_are_the_vertical_axis_and_ascend(made):
    # The values differ along both axes, so a turned or mirrored map would differ too.
    sweep = made(GRID, lambda a: {"settling_time": 100 * (a[X] + 2) + a[Y]})
    (panel,) = figures_in(sweep_sections(sweep))["sweep-1-map"].panels
    cells = cells_of(panel)
    assert panel.x.text == "initial angular_velocity[0] [rad/s]"
    assert panel.y.text == "initial angular_velocity[1] [rad/s]"
    assert cells.x.tolist() == [-2, -1, 0, 1, 2]
    assert cells.y.tolist() == [0, 10, 20, 30]
    expected = [[100 * i + 10 * j for i in range(5)] for j in range(4)]
    assert cells.values.tolist() == expected


def test_lists_that_descend_are_turned(made):
    vary = {"body.mass": {"values": [3, 1, 2]}, f"{SPIN}[0]": {"linspace": [1, -1, 2]}}
    sweep = made(vary, lambda a: {"settling_time": a["body_mass"] + 10 * a[X]})
    cells = cells_of(figures_in(sweep_sections(sweep))["sweep-1-map"].panels[0])
    assert cells.x.tolist() == [1, 2, 3]
    assert cells.y.tolist() == [-1, 1]
    assert cells.values.tolist() == [[-9, -8, -7], [11, 12, 13]]


def test_outcomes_are_words(made):
    def columns(a):
        return {
            "status": np.where(a[X] > 0, code("range left"), 0),
            "settling_time": np.where(a[Y] > 5, np.nan, 1.0),
            "smallest_regularity": a[Y] + 1,
            "final_orientation": np.radians(np.outer(2 * a[Y], [0, 1, 0])),
        }

    sections = sweep_sections(made(GRID, columns))
    first, others = (figures_in(sections)[f"sweep-1-{name}"] for name in ("first", "map"))
    assert [panel.title for panel in first.panels] == ["outcome", "final tilt [°]"]
    assert [panel.title for panel in others.panels] == ["smallest cos θ2"]
    # They stand beside the answer, before the card.
    assert next(block for block in sections[0].blocks if not isinstance(block, str)) is first
    cells = cells_of(first.panels[0])
    assert cells.scale.categories == ("returns", "still moving", "left the range")
    row = [1.0, 1.0, 1.0, 2.0, 2.0]
    assert cells.values.tolist() == [[0.0, 0.0, 0.0, 2.0, 2.0], row, row, row]
    tilts = cells_of(first.panels[1]).values
    assert tilts[0].tolist() == pytest.approx([0.0] * 5)
    assert tilts[1].tolist() == pytest.approx([20.0] * 5)


def test_members_without_a_number_leave_gaps(made):
    def columns(a):
        peak = np.stack([-a[Y], 0.1 * a[Y], 0 * a[Y]], axis=1)
        peak[a[X] == 1] = np.inf
        return {
            "status": np.where(a[X] == 2, code("diverged"), 0),
            "peak_contact_displacement": peak,
        }

    figure = figures_in(sweep_sections(made(GRID, columns)))["sweep-1-map"]
    (panel,) = (p for p in figure.panels if p.title == "largest |E1|, |E2| or |E3| [m]")
    values = cells_of(panel).values
    assert np.isnan(values[:, 3:]).all()
    assert values[:, :3].tolist() == [[y] * 3 for y in (0.0, 10.0, 20.0, 30.0)]


def test_a_third_axis_is_cut_into_slices(made):
    vary = GRID | {"controller.K_r": {"scale": {"geomspace": [0.01, 1, 3]}}}
    sweep = made(vary, lambda a: {"settling_time": a[X] + a[Y] * a["controller_K_r"] + 3})
    figure = figures_in(sweep_sections(sweep))["sweep-1-map-settling-time"]
    assert [p.title for p in figure.panels] == [
        f"K_r[0] (with all of K_r) = {f}" for f in (4, 40, 400)
    ]
    for panel, factor in zip(figure.panels, (0.01, 0.1, 1.0), strict=True):
        cells = cells_of(panel)
        expected = cells.x[np.newaxis] + cells.y[:, np.newaxis] * factor + 3
        assert cells.values == pytest.approx(expected)
        # All slices share one scale, from the smallest to the largest number of all.
        assert cells.span == pytest.approx((1.0, 35.0))


def test_further_axes_are_taken_together(made):
    vary = GRID | {"body.mass": {"values": [1, 2]}, f"{SPIN}[2]": {"values": [10, 20, 60]}}
    sweep = made(vary, lambda a: {"settling_time": a[X] * 1000 + a["initial_angular_velocity_2"]})
    figure = figures_in(sweep_sections(sweep))["sweep-1-map-settling-time"]
    # The longest other axis is cut into slices; each cell is a median over the rest.
    assert [p.title for p in figure.panels] == [
        f"initial angular_velocity[2] = {v}" for v in (10, 20, 60)
    ]
    assert "mass" in figure.caption
    assert cells_of(figure.panels[2]).values[0].tolist() == [-1940, -940, 60, 1060, 2060]


def test_cells_hold_medians_and_shares(members):
    design = {"design": "random", "members": 3000, "seed": 3}
    vary = {"body.mass": {"uniform": [1, 9]}, f"{SPIN}[0]": {"normal": [0, 1]}}
    found = members(vary, lambda a: {"settling_time": np.sin(a["run"])}, **design)
    x, y = (binned(p, n) for p, n in zip(found.parameters, (3, 7), strict=True))
    area = map_grid(x, y)
    settling, yes = found.column("settling_time"), np.sin(found.column("run")) > 0.5
    middle, share = medians(area, settling), shares(area, yes)
    assert middle.shape == share.shape == (7, 3)
    for row in range(7):
        for column in range(3):
            own = np.flatnonzero((y.indices == row) & (x.indices == column))
            if len(own) < 5:
                assert np.isnan(middle[row, column])
                assert np.isnan(share[row, column])
                continue
            assert middle[row, column] == statistics.median(settling[own].tolist())
            assert share[row, column] == sum(yes[own].tolist()) / len(own)
    assert np.isfinite(share).sum() > 12


def test_the_outline_is_where_a_quantity_has_its_value(members):
    fine = {
        f"{SPIN}[0]": {"linspace": [-2, 2, 81]},
        f"{SPIN}[1]": {"linspace": [-3, 3, 61]},
    }
    found = members(fine)
    x, y = (binned(p) for p in found.parameters)
    radius = np.hypot(found.column(X) / 1.5, found.column(Y) / 2)
    curve = contour_line(map_grid(x, y), radius, 1.0, "ellipse")
    assert isinstance(curve, Line)
    drawn = np.isfinite(curve.x)
    assert np.hypot(curve.x[drawn] / 1.5, curve.y[drawn] / 2) == pytest.approx(1, abs=2e-3)
    assert (np.nanmin(curve.x), np.nanmax(curve.y)) == pytest.approx((-1.5, 2.0), abs=1e-2)
    assert contour_line(map_grid(x, y), radius, 9.0, "none") is None


def test_few_drawn_members_are_points(made):
    vary = {"body.mass": {"uniform": [1, 9]}, f"{SPIN}[0]": {"normal": [0, 1]}}
    columns = {"design": "random", "members": 40, "seed": 3}
    sweep = made(vary, lambda a: {"settling_time": np.where(a[X] > 0, 1, np.nan)}, **columns)
    figure = figures_in(sweep_sections(sweep))["sweep-1-first"]
    panel, tilts = figure.panels
    assert (tilts.x, tilts.y.text) == (panel.x, "final tilt [°]")
    settled, unsettled = panel.marks
    assert isinstance(settled, Points)
    assert isinstance(unsettled, Points)
    across = {panel.x.label: "x", panel.y.label: "y"}["initial angular_velocity[0]"]
    assert (getattr(settled, across) > 0).all()
    assert (getattr(unsettled, across) <= 0).all()
    assert len(settled.x) + len(unsettled.x) == 40
    assert len(settled.texts) == len(settled.x)


def test_curves_along_a_single_axis(made):
    vary = {"controller.K_r": {"scale": {"geomspace": [100, 0.01, 5]}}}
    sweep = made(
        vary,
        lambda a: {
            "settling_time": np.where(a["controller_K_r"] > 50, np.nan, a["controller_K_r"]),
            "peak_contact_displacement": np.outer(a["controller_K_r"], [1, -2, 3]),
        },
    )
    figures = figures_in(sweep_sections(sweep))
    (outcome,) = figures["sweep-1-first"].panels
    settling, peaks = figures["sweep-1-curves"].panels
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
    lines = [mark for mark in peaks.marks if isinstance(mark, Line)]
    assert len(lines) == len(peaks.marks)
    # A signed peak would jump where the largest displacement changes its side.
    assert [mark.y[2] for mark in lines] == pytest.approx([1, 2, 3])
    assert [mark.label for mark in lines] == ["|E1|", "|E2|", "|E3|"]


def test_variants_have_maps_of_their_own(made):
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    sweep = made(vary, lambda a: {"settling_time": a[Y] + 100 * a["controller_variant"]})
    free, tied = figures_in(sweep_sections(sweep))["sweep-1-map-settling-time"].panels
    assert (free.title, tied.title) == ("free", "visco-elastic")
    assert cells_of(free).values[:, 0].tolist() == [0, 10, 20, 30]
    assert cells_of(tied).values[:, 0].tolist() == [100, 110, 120, 130]


def test_the_round_off_of_a_start_at_rest_is_not_mapped(members):
    """Driven members start at rest: v(0) is zero up to round-off, and v(end) is some J."""

    def at_rest(arrays):
        noise = np.where(arrays["run"] % 2, 1e-19, -3e-20)
        return {"lyapunov_start": noise, "lyapunov_end": np.full(len(noise), 2.0)}

    assert not start_energy(members(GRID, at_rest)).values.any()
