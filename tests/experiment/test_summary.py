"""Protects the summary of a run: no number of samples changes its extremes and its rest."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.paper_runs import paper_config

import rbstab
from rbstab.analysis import run_extremes
from rbstab.analysis.settling import SETTLED_FRACTION
from rbstab.config.build import problem_of
from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.summary import at_rest_from, half_unit, settling_time_of, summary_of
from rbstab.integrate import step_ends
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.systems.system import System

SPINS = ((16, 32, -16), (-20, 5, 25), (0, -8, 0))
COUNTS = (5, 50, 401)
ROOT = Path(__file__).parents[2]
each_engine = pytest.mark.parametrize("engine", ["scipy", "heyoka"])


def config_of(samples, spin, engine):
    config = paper_config("visco-elastic", duration=1.5, samples=samples, rtol=1e-9, engine=engine)
    config["initial"]["angular_velocity"] = list(spin)
    return config


@cache
def run(samples, spin, engine="scipy"):
    return rbstab.simulate(rbstab.load_config(config_of(samples, spin, engine)))


def watched(system, y):
    seen = system.observe(y)
    return np.array([*seen.motion.E, seen.motion.Theta[1], seen.energy.sum()])


@cache
def exact(spin):
    """Return the peaks of E, |E| and |θ2|, and the settling time, of 100,001 accurate samples.

    Parabolas through a largest sample and its neighbours are as accurate as 1e-9 of it.
    """
    problem = problem_of(rbstab.load_config(config_of(5, spin, "scipy")))
    system, times = problem.system, np.linspace(0.0, 1.5, 100_001)
    rates, observe = (
        StraightLine(function, system, system.size) for function in (System.rates, watched)
    )
    tight = {"rtol": 1e-13, "atol": 1e-15}
    motion = solve_ivp(lambda _, y: rates(y), (0, 1.5), problem.start, "DOP853", times, **tight)
    table = np.array([observe(y) for y in motion.y.T]).T
    E, v = table[:3], table[4] - float(run(5, spin)["energy_at_rest"])
    values = [*np.abs(E), np.sqrt((E * E).sum(axis=0)), np.abs(table[3])]
    *by_axis, distance, pitch = (parabola(quantity) for quantity in values)
    last = int(np.flatnonzero(v >= SETTLED_FRACTION * v[0])[-1])
    settled = np.interp(0.0, SETTLED_FRACTION * v[0] - v[last : last + 2], times[last : last + 2])
    return np.array(by_axis), distance, pitch, float(settled)


def parabola(values):
    """Return the top of the parabola through the largest value and its neighbours."""
    best = int(np.clip(values.argmax(), 1, len(values) - 2))
    before, at, after = values[best - 1 : best + 2]
    return float(at - (after - before) ** 2 / (8.0 * (before - 2.0 * at + after)))


@each_engine
@pytest.mark.parametrize("samples", COUNTS)
@pytest.mark.parametrize("spin", SPINS)
def test_extremes_are_those_of_very_many_samples(samples, spin, engine):
    """Within their errors, and those of a run with a tolerance of 1e-9."""
    result = run(samples, spin, engine)
    summary, (by_axis, distance, pitch, settled) = summary_of(result), exact(spin)
    assert summary.resolved
    error = result["peak_contact_displacement_error"] + 1e-8 * distance
    assert (np.abs(np.abs(summary.peak_contact_displacement) - by_axis) <= error).all()
    for value, true, name in (
        (summary.peak_distance, distance, "peak_distance"),
        (summary.largest_pitch, pitch, "largest_pitch"),
        (settling_time_of(result), settled, "settling_time"),
    ):
        assert abs(value - true) <= float(result[f"{name}_error"]) + 1e-7 * true, name
        assert float(result[f"{name}_error"]) <= 1e-5 * true
    assert at_rest_from(result) == f"{settled:.4g}"


def test_steps_of_heyoka_do_not_depend_on_samples():
    few, some, many = (run(samples, SPINS[0], "heyoka") for samples in COUNTS)
    for name in ("peak_contact_displacement", "peak_distance", "largest_pitch", "settling_time"):
        assert few[name].tobytes() == some[name].tobytes() == many[name].tobytes()


def test_joined_steps_do_not_depend_on_samples_either(monkeypatch):
    """A run of too many steps joins short ones: its peaks are lower bounds."""
    whole = run(21, SPINS[0], "heyoka")
    monkeypatch.setattr(step_ends, "MOST", 40)
    run.cache_clear()
    few, many = (run(samples, SPINS[0], "heyoka") for samples in COUNTS[::2])
    run.cache_clear()
    for name in ("peak_contact_displacement", "peak_distance", "largest_pitch"):
        assert few[name].tobytes() == many[name].tobytes()
        assert np.isnan(few[f"{name}_error"]).all()
        assert (np.abs(few[name]) <= np.abs(whole[name]) + whole[f"{name}_error"]).all()
    settled = float(whole["settling_time"])
    assert few["settling_time"].tobytes() == many["settling_time"].tobytes()
    assert abs(float(few["settling_time"]) - settled) <= float(few["settling_time_error"])
    # More samples would not help, so the words for ≥ and ≤ do not name them.
    assert not summary_of(many).resolved
    for fact in ("peak |E|", "at rest from"):
        assert "not known" in FACTS[fact].words
        assert "sample" not in FACTS[fact].words


def test_of_too_many_steps_only_the_short_ones_are_joined(monkeypatch):
    monkeypatch.setattr(step_ends, "MOST", 400)
    rng, ends = np.random.default_rng(5), step_ends.StepEnds()
    system = problem_of(rbstab.load_config(config_of(5, SPINS[0], "scipy"))).system
    lengths = [0.1] * 20 + [1e-6] * 5000 + [0.1] * 20 + rng.uniform(0, 1e-3, 3000).tolist()
    times = np.concatenate([[0.0], np.cumsum(lengths)])
    for t in times.tolist():
        ends.add(t, np.array([t]), system)
    kept, whole = np.array(ends.times), np.array(ends.whole)
    assert not ends.complete
    assert len(kept) <= 400
    assert (kept[0], kept[-1]) == (times[0], times[-1])
    assert [y[0] for y in ends.states] == kept.tolist()
    # Each whole step is one of the run, and the joined ones are short.
    before = times[np.searchsorted(times, kept[1:]) - 1]
    assert (whole[1:] == (before == kept[:-1])).all()
    assert whole[1:][np.diff(kept) > 0.05].sum() == 40
    assert np.diff(kept)[~whole[1:]].max() <= 4 * times[-1] / 400
    part = ends.until(3.0)
    assert len(part.times) == len(part.whole) == (kept <= 3.0).sum()


def test_without_steps_extremes_are_those_of_samples(monkeypatch):
    """Where no steps are known, peaks are lower bounds, and the run rests from a bound."""
    whole = run(21, SPINS[2])
    monkeypatch.setattr(run_extremes._StepsOfRun, "steps", lambda _: None)
    run.cache_clear()
    result = run(21, SPINS[2])
    run.cache_clear()
    summary = summary_of(result)
    assert not summary.displacement_resolved
    assert not summary.pitch_resolved
    assert summary.peak_distance == np.linalg.norm(result["contact_displacement"], axis=1).max()
    assert summary.peak_distance < summary_of(whole).peak_distance
    text = at_rest_from(result)
    settled = settling_time_of(whole)
    assert text.startswith("≤ ")
    assert settled <= float(text[2:]) <= settled + 2 * result["time"][1]


@pytest.mark.parametrize(
    ("number", "half"),
    [(0.092, 5e-4), (-0.1, 0.05), (3.0, 0.5), (100.0, 0.5), (0.0, 0.5), (1e-4, 5e-5)],
)
def test_half_a_unit_of_the_last_printed_digit(number, half):
    assert half <= half_unit(number) < 1.001 * half
