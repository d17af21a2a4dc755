"""The pictures on the cards of runs: straight lines for exponential decays, on common scales."""

import math

import numpy as np
import pytest
from report.runs.stored import runs_of, with_v
from support.made_runs import DECAY, V_START, made_file

from rbstab.report.runs.sketches import decay_sketches


def sketches_of(runs):
    return decay_sketches(runs)


END = 2.0
"""s: the duration of a made up run."""


@pytest.fixture
def run(tmp_path):
    return runs_of(made_file(tmp_path / "a.h5"))[0]


def test_an_exponential_decay_is_a_straight_line_from_corner_to_corner(run):
    (sketch,) = sketches_of([run])
    ((label, points),) = sketch.curves
    assert label == ""
    assert points[:, 0] == pytest.approx(np.linspace(0, 1, 401))
    assert points[:, 1] == pytest.approx(1 - points[:, 0])
    assert sketch.caption.startswith("v(t)/v(0), logarithmic, over time.")
    assert (sketch.x_ends, sketch.y_ends) == (("0 s", "2 s"), ("1.1e-7", "1"))
    assert math.exp(-DECAY * END) == pytest.approx(1.125e-7, rel=1e-3)


def test_the_dot_stands_where_the_run_is_at_rest(run):
    (sketch,) = sketches_of([run])
    ((across, up),) = sketch.marks.tolist()
    # v = v(0)/1000 at t = ln(1000)/8.
    assert across == pytest.approx(math.log(1000) / DECAY / END)
    assert up == pytest.approx(1 - across, abs=1e-6)
    assert sketch.caption.endswith("Dot: at rest from there on.")


def test_all_runs_have_the_scale_of_the_lowest(run, tmp_path):
    slow = runs_of(with_v(tmp_path / "slow.h5", lambda t, _: V_START * np.exp(-t)))[0]
    fast, other = sketches_of([run, slow])
    assert fast.caption == other.caption
    ((_, points),) = other.curves
    # One decade of the slow run is as high as one of the fast run.
    assert points[-1, 1] == pytest.approx(1 - 1 / DECAY)
    assert not len(other.marks)


def test_round_off_is_not_drawn(tmp_path):
    def change(t, v):
        v[t > 1.0] = 1e-20 * V_START
        v[-1] = -1e-21
        return v

    (sketch,) = sketches_of(runs_of(with_v(tmp_path / "a.h5", change)))
    ((_, points),) = sketch.curves
    # Until t = 1 s, sample 200, v falls by exp(8); along the lower edge it would seem to stay.
    assert sketch.y_ends == ("0.00034", "1")
    assert points[200, 1] == pytest.approx(0.0, abs=1e-12)
    assert np.isfinite(points[:201, 1]).all()
    assert np.isnan(points[201:, 1]).all()


@pytest.mark.parametrize("start", [0.0, math.nan, -1.0])
def test_a_run_without_a_positive_start_has_no_picture(run, start, tmp_path):
    def change(_, v):
        v[0] = start
        return v

    (other,) = runs_of(with_v(tmp_path / "b.h5", change))
    assert decay_sketches([other, run])[0] is None
    assert decay_sketches([other]) == [None]
