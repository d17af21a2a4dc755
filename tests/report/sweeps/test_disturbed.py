"""Protects the figure of the largest tilts over the sizes of disturbances, and the proved bound."""

import numpy as np
import pytest
from support.gusts import mast
from support.sections import check_sections, figures_in, sweep_sections

from rbstab.report.model.figure import Band, Figure, Level, Points
from rbstab.report.sweeps.disturbed import disturbed_blocks
from rbstab.report.sweeps.members import read_members
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs.disturbed import keep_bounds

SIZES = np.linspace(2, 50, 60)
PEAKS = 0.016 * SIZES
"""rad: the sizes above 31.25 N m are beyond the bound of 0.5 rad."""


def written(made, *, proved=True, start=0.0):
    """Return a sweep with made up peaks."""
    vary = {
        "elements.gust0.amplitude": {"values": SIZES.tolist()},
        "initial.orientation[2]": {"values": [start]},
    }
    base = mast()
    if proved:
        keep_bounds(load_plan({"base": base, "vary": vary}), made.args[0].parents[1])
    return made(vary, lambda _: {"peak_tilt": PEAKS}, base=base)


def panel_of(sweep):
    found = read_members(sweep.path).disturbed
    assert found is not None
    sentences, figure = disturbed_blocks("sweep-1", found, "COMMAND")
    assert isinstance(figure, Figure)
    assert str(sentences).startswith("Worst tilt: 0.8 rad")
    (panel,) = figure.panels
    return figure, panel


@pytest.mark.slow
def test_the_figure_has_the_members_and_both_bounds(made):
    sweep = written(made)
    figure, panel = panel_of(sweep)
    points = {m.label.partition(":")[0]: m for m in panel.marks if isinstance(m, Points)}
    assert points["stays below for ever"].x == pytest.approx(SIZES[SIZES <= 20])
    assert points["stayed below in this run"].x == pytest.approx(
        SIZES[(SIZES > 20) & (PEAKS <= 0.5)]
    )
    assert points["tilted farther"].y == pytest.approx(PEAKS[PEAKS > 0.5])
    assert points["worst"].y.tolist() == [PEAKS.max()]
    assert points["worst"].members == (59,)
    levels = {(m.vertical, m.value) for m in panel.marks if isinstance(m, Level)}
    assert levels == {(False, 0.5), (True, 20.0)}
    (band,) = (m for m in panel.marks if isinstance(m, Band))
    assert (band.x.tolist(), band.low.tolist()) == ([0.0, 20.0], [0.5, 0.5])
    count = int((PEAKS > 0.5).sum())
    assert f"{count} of 60 members" in figure.caption
    # A grid is no sample.
    assert "Probability" not in figure.caption
    sections = sweep_sections(sweep)
    check_sections(sections)
    assert next(iter(figures_in(sections))).endswith("disturbed")


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{"proved": False}, {"start": 0.6}])
def test_nothing_is_shaded_of_which_it_is_not_proved(made, changes):
    figure, panel = panel_of(written(made, **changes))
    assert not any(isinstance(mark, Band) for mark in panel.marks)
    assert "proved" not in figure.caption
    labels = [mark.label for mark in panel.marks if isinstance(mark, Points)]
    assert not any("proved" in label for label in labels)


def test_the_caption_of_random_members_has_a_probability(made):
    def columns(arrays):
        return {"peak_tilt": 0.016 * arrays["elements_gust0_amplitude"]}

    vary = {"elements.gust0.amplitude": {"uniform": [2, 50]}}
    sweep = made(vary, columns, base=mast(), design="random", members=60, seed=2)
    found = read_members(sweep.path).disturbed
    assert found is not None
    _, figure = disturbed_blocks("sweep-1", found, "")
    assert isinstance(figure, Figure)
    assert "Probability: " in figure.caption


def test_a_sweep_that_states_no_bound_has_no_such_figure(members):
    assert members({"body.mass": {"values": [40, 41]}}).disturbed is None
