"""Protects how far a motion with impacts against a stop is trusted."""

import numpy as np
import pytest
from support.stops import ANGLE, stop, stopped
from support.switching import ENGINES, data, solved

from rbstab.integrate.switching import trust

EACH = pytest.mark.parametrize("engine_name", ENGINES)

CHAOTIC = data(
    {
        "end": stop(1.0, 0.2),
        "upright": {"kind": "attitude", "K": [60.0, 100.0, 30.0], "L": [1e-6] * 3},
        "spring": {
            "kind": "spring",
            "point": [0.5, 0.2, 0.1],
            "anchor": [1.0, 0.5, 0.3],
            "stiffness": 50.0,
            "rest_length": 0.3,
        },
    },
    {"angular_velocity": [0.7, 2.3, 0.4]},
    {"duration": 60.0, "samples": 601},
)
"""An elastic body on springs between its stops: impacts multiply errors."""


@pytest.mark.slow
def test_engines_agree_as_long_as_a_motion_is_trusted_and_no_longer():
    runs = [solved(CHAOTIC, name) for name in ENGINES]
    trusted = min(run.trusted_until for run in runs)
    assert 20 < trusted < 50
    apart = np.abs(runs[0].states - runs[1].states)[:, :6]
    t, size = runs[0].times, np.abs(runs[0].states[:, :6]).max(axis=0)
    # The rounding errors of two programs are some times as large as the difference of the starts.
    assert (apart[t < 0.8 * trusted] / size).max() < 1e-3
    assert (apart[t > trusted + 5] / size).max() > 0.1
    assert runs[0].impacts.counts[t < 0.8 * trusted][-1] > 20


@EACH
def test_impacts_of_a_regular_motion_are_trusted_to_the_end(engine_name):
    trajectory = solved(stopped(0.7, 1.3, duration=14.9, samples=31), engine_name)
    assert trajectory.impacts.counts[-1] > 5
    assert trajectory.trusted_until == trajectory.times[-1]


@EACH
@pytest.mark.parametrize(("spin", "samples"), [(1.0, 21), (1.0, 61), (1.3, 31), (0.5, 11)])
def test_an_impact_at_a_sample_is_no_chaos(engine_name, spin, samples):
    """The rates of both runs have opposite signs there, if one meets the stop a little later."""
    trajectory = solved(stopped(1.0, spin, duration=6.0, samples=samples), engine_name)
    meets = np.abs(trajectory.impacts.times[:, np.newaxis] - trajectory.times).min(axis=1)
    assert meets.min() < 1e-12
    assert trajectory.trusted_until == 6.0


@EACH
@pytest.mark.parametrize("spin", [0.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_second_run_does_not_start_beyond_the_stop(engine_name, spin, side):
    """Of a body that rests on its stop, or leaves it and comes back to it."""
    start = {"orientation": [0, side * ANGLE, 0], "angular_velocity": [0, side * spin, 0]}
    push = {
        "kind": "input",
        "quantity": "couple",
        "direction": [0, side, 0],
        "amplitude": 3.0,
        "signal": {"kind": "constant"},
    }
    config = data({"end": stop(0.5), "push": push}, start, {"duration": 5.0, "samples": 11})
    trajectory = solved(config, engine_name)
    assert trajectory.impacts.resting[-1] == side
    assert trajectory.trusted_until == 5.0


def test_one_impact_needs_no_second_run(monkeypatch):
    monkeypatch.setattr(trust, "_trusted_until", None)
    trajectory = solved(stopped(1.0, 1.3, duration=0.5, samples=4), "heyoka")
    assert trajectory.impacts.counts[-1] == 1
    assert trajectory.trusted_until == 0.5
