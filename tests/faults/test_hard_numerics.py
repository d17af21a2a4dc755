"""Extreme but valid configs end with a named status, and their certificates say the truth.

A free body that turns about its first axis is four damped oscillators, so the exact motion is known
for any size of masses, gains, loads and times. All other motions are compared between the engines.
A result that is not accurate to 1e-9 has to say so: by its status, its audit or its warnings.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml
from flint import acb, ctx
from support.configs import BY_VARIANT, plain
from support.hang_guard import within
from support.problems import ENGINES, each_engine

from rbstab.analysis.lyapunov import DIGITS
from rbstab.analysis.settling import value_round_off
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_run import certificate_lines

ACCURACY = 1e-9
"""Relative to the largest value of a quantity over the run."""

QUANTITIES = ("orientation", "angular_velocity", "position", "velocity")

LIMITS = ("step limit", "time limit", "switch limit")

SLIDING = """\
title: Hard
body:
  mass: 41.0
  inertia: [10.0, 8.0, 4.0]
  contact_point: [0.15, 0.10, -0.42]
controller:
  variant: sliding
  K_t: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [400, 400, 320]
  L_r: [60, 60, 42]
  surface: position
  K_s: [600, 600, 600]
initial:
  angular_velocity: [4, 8, -4]
integration:
  duration: 0.2
  samples: 11
"""

TEXTS = BY_VARIANT | {"sliding": SLIDING}


def run(variant, engine, changes):
    """Return the result of a config of this variant with changes; fail if it takes 30 s."""
    settings = {"integration.step_limit": 1500, "integration.time_limit": 5.0} | changes
    settings |= {"integration.engine": engine, "title": "hard"}
    config = load_config(plain(TEXTS[variant]), [f"{k}={v}" for k, v in settings.items()])
    return within(30, simulate, config)


def lines_of(result):
    """Return the checks of the certificate by name."""
    return {line.check: line for line in certificate_lines(result)}


def says_so(result):
    """Return whether a result says that its numbers are not accurate to 1e-9."""
    warned = "guarantees" in str(result.attributes["warnings"])
    return warned or lines_of(result)["audit"].verdict == "violated"


def assert_truthful(result):
    """Assert what holds for every result: its residual and its verdict follow from its arrays."""
    v, energy = result["lyapunov"], result["energy"]
    np.testing.assert_allclose(v, energy.sum(axis=1) - result["energy_at_rest"], rtol=1e-15)
    removed = result["discarded_energy"] if "sliding" in result.attributes["variant"] else 0.0
    r = v - v[0] - (result["lyapunov_change"] - removed)
    np.testing.assert_array_equal(result["energy_residual"], r)
    lines = lines_of(result)
    problem = problem_of(load_config(yaml.safe_load(result.config)))
    round_off = value_round_off(lambda y: problem.system.observe(y).energy, problem.start)
    scale = max(np.abs(v).max(), DIGITS * round_off)
    size = np.abs(r).max() / scale
    assert lines["audit"].value == pytest.approx(size, rel=1e-12, abs=0)
    # An implicit step is of first order, whatever its tolerance.
    bound = 1e-2 if "implicit: " in result.config else 1e-8
    # Sums of energies that are far larger than v have round-off: 16 units in their last place.
    sums = np.abs(energy).sum(axis=1) + np.abs(result["energy_at_rest"])
    bound = max(bound, 16 * np.finfo(float).eps * sums.max() / scale)
    assert lines["audit"].bound == pytest.approx(bound, rel=1e-12)
    assert (lines["audit"].verdict == "violated") == (size > bound)
    # The equations are right, so nothing but lost accuracy may be blamed.
    for name in ("decrease", "damping", "positive", "derivative"):
        assert lines[name].verdict != "violated", lines[name]
    assert result.attributes["verdict"] == worst([line.verdict for line in lines.values()][:5])


def worst(verdicts):
    """Return the worst of some verdicts."""
    return max(verdicts, key=["consistent", "unknown", "violated"].index)


SLOW_CASES = {
    "J 1e12:1:1 of a held body",
    "J 1:1:1e12",
    "J turned 1e12",
    "K_r turned 1e12",
    "stiff K_c",
    "stiff own state",
    "R = 1e8 near rest",
    "spin 1e6",
    "K_s = 1e9",
    "K_s = 1e12 in a layer",
}
"""These meet a limit; the daily tests run them with fewer steps."""

LONG_CASES = {
    "gravity 1e6",
    "K_s = 1e9 on a slope",
}
"""These are completed, but not in a second."""


def marked(case):
    """Return a case with the mark of a slow one, if it is slow."""
    slow = case in SLOW_CASES | LONG_CASES | {"mass 1e12", "1e4 s"}
    return pytest.param(case, marks=pytest.mark.slow) if slow else case


class Axis(NamedTuple):
    """m ẍ + c ẋ + k x = f from x(0) and ẋ(0)."""

    m: float
    c: float
    k: float
    f: float
    start: float
    speed: float

    def at(self, times):
        """Return x and ẋ at some times, from the exponential solution in 400 bits."""
        with ctx.workprec(400):
            m, c, k, f = (acb(value) for value in (self.m, self.c, self.k, self.f))
            root = (c * c - 4 * m * k).sqrt()
            first, second = (-c + root) / (2 * m), (-c - root) / (2 * m)
            x, w = self.start - f / k, acb(self.speed)
            p, q = (w - second * x) / (first - second), (first * x - w) / (first - second)
            positions, speeds = [], []
            for t in times.tolist():
                along_first, along_second = p * (first * t).exp(), q * (second * t).exp()
                positions.append(float((f / k + along_first + along_second).real))
                speeds.append(float((first * along_first + second * along_second).real))
        return np.array(positions), np.array(speeds)


def diagonal(value):
    return [value, value, value]


def gains(K_t, L_t, K_r, L_r):
    """Return equal gains for all axes."""
    values = {"K_t": K_t, "L_t": L_t, "K_r": K_r, "L_r": L_r}
    return {f"controller.{name}": diagonal(value) for name, value in values.items()}


class Oscillator(NamedTuple):
    """A case with a known motion: its changes, and the engines that cannot follow it to 1e-9."""

    changes: dict[str, Any]
    inaccurate: tuple[str, ...] = ()


SPIN = {"initial.angular_velocity": [3.0, 0.0, 0.0]}

OSCILLATORS = {
    "J 1e12:1:1": Oscillator({"body.inertia": [1e12, 1.0, 1.0], **SPIN}),
    "J 1e-12": Oscillator(
        {"body.inertia": diagonal(1e-12), "integration.duration": 1e-12, **SPIN}, ENGINES
    ),
    "K 1e8:1": Oscillator(
        {
            "controller.K_t": [4.1e9, 41.0, 41.0],
            "controller.K_r": [4e8, 4.0, 4.0],
            "integration.duration": 2e-3,
            "initial.position": [1e-2, 1e-2, 0.0],
            **SPIN,
        }
    ),
    "L 1e8:1": Oscillator(
        {
            "controller.L_t": [2e8, 2.0, 2.0],
            "controller.L_r": [6e8, 6.0, 6.0],
            "integration.duration": 1e-6,
            "initial.position": [1.0, 1.0, 0.0],
            "initial.orientation": [1.0, 0.0, 0.0],
            "initial.velocity": [1.0, 1.0, 0.0],
            **SPIN,
        }
    ),
    "mass 1e12": Oscillator({"body.mass": 1e12, "gravity": [0.0, 0.0, -9.81], **SPIN}),
    "all of it tiny": Oscillator(
        {
            "body.mass": 1e-12,
            "body.inertia": diagonal(1e-18),
            "gravity": [0.0, 0.0, -9.81],
            **gains(1e-9, 1e-12, 1e-15, 1e-18),
            **SPIN,
        }
    ),
    "gravity 1e-9": Oscillator({"gravity": [0.0, 0.0, -1e-9]}, ENGINES),
    "gravity 1e9": Oscillator({"gravity": [0.0, 0.0, -1e9], **SPIN}, ("heyoka",)),
    "speed 1e6": Oscillator({"initial.velocity": [1e6, 0.0, 0.0], **SPIN}, ("heyoka",)),
    "spin 1e-12": Oscillator({"initial.angular_velocity": [1e-12, 0.0, 0.0]}, ("scipy",)),
    "1e4 s": Oscillator(
        {
            **gains(4e-3, 8e-3, 1e-3, 2e-3),
            "integration.duration": 1e4,
            "integration.samples": 101,
            "integration.step_limit": 10000,
            "initial.position": [0.1, 0.0, 0.0],
            "initial.angular_velocity": [1e-3, 0.0, 0.0],
        }
    ),
}


def exact_motion(changes, t):
    """Return the motion of a free body that turns about its first axis, by the theory."""
    values: dict[str, Any] = {f"initial.{name}": diagonal(0.0) for name in ("position", "velocity")}
    values |= {"gravity": diagonal(0.0), "initial.angular_velocity": diagonal(0.0)}
    for section in ("body", "controller"):
        values |= {f"{section}.{k}": x for k, x in plain(TEXTS["free"])[section].items()}
    values |= {"initial.orientation": diagonal(0.0)} | changes

    def along(i):
        return Axis(
            values["body.mass"],
            values["controller.L_t"][i],
            values["controller.K_t"][i],
            values["body.mass"] * values["gravity"][i],
            values["initial.position"][i],
            values["initial.velocity"][i],
        ).at(t)

    angle, spin = Axis(
        values["body.inertia"][0],
        values["controller.L_r"][0],
        values["controller.K_r"][0],
        0.0,
        values["initial.orientation"][0],
        values["initial.angular_velocity"][0],
    ).at(t)
    axes, zero = [along(i) for i in range(3)], np.zeros_like(t)
    return {
        "orientation": np.column_stack([angle, zero, zero]),
        "angular_velocity": np.column_stack([spin, zero, zero]),
        "position": np.column_stack([x for x, _ in axes]),
        "velocity": np.column_stack([v for _, v in axes]),
    }


def largest_difference(result, expected, count):
    """Return the largest difference of the first samples, relative to the largest value."""
    differences = []
    for name in QUANTITIES:
        scale = np.abs(expected[name]).max() or 1.0
        differences.append(np.abs(result[name][:count] - expected[name][:count]).max() / scale)
    return float(max(differences))


@each_engine
@pytest.mark.parametrize("case", [marked(case) for case in OSCILLATORS])
def test_oscillators_of_any_size_follow_the_theory(case, engine):
    changes, inaccurate = OSCILLATORS[case]
    result = run("free", engine, {"initial.angular_velocity": diagonal(0.0)} | changes)
    assert result.status == "completed"
    assert_truthful(result)
    expected = exact_motion(changes, result["time"])
    error = largest_difference(result, expected, len(result["time"]))
    if engine in inaccurate:
        assert says_so(result)
    else:
        assert error < ACCURACY
        assert result.attributes["verdict"] == "consistent"


def turned(values, seed=1):
    """Return a symmetric matrix with these eigenvalues and arbitrary eigenvectors."""
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    matrix = Q @ np.diag(values) @ Q.T
    rows: list[list[float]] = (0.5 * (matrix + matrix.T)).tolist()
    return rows


SLOW = {"initial.angular_velocity": [1e-2, 1e-2, 1e-2], "integration.duration": 0.1}
NEAR = math.pi / 2

COMPARED: dict[str, tuple[str, dict[str, Any]]] = {
    "J 1e12:1:1 of a held body": ("permanent", {"body.inertia": [1e12, 1.0, 1.0]}),
    "J 1:1:1e12": ("embedded", {"body.inertia": [1.0, 1.0, 1e12]}),
    "J turned 1e12": ("free", {"body.inertia": turned([1e12, 1e6, 1.0]), **SLOW}),
    "K_r turned 1e12": ("free", {"controller.K_r": turned([4e12, 4e6, 4.0])}),
    "stiff K_c": ("visco-elastic", {"controller.K_c": diagonal(1e12)}),
    "stiff own state": ("embedded", {"controller.L_d": diagonal(1e-6)}),
    "cos θ2 = 1e-6": (
        "permanent",
        {
            "initial.orientation": [0.0, NEAR - 1e-6, 0.0],
            "initial.angular_velocity": [0.0, -0.5, 0.0],
            "integration.range_bound": 1e-9,
            "integration.duration": 0.2,
        },
    ),
    "cos θ2 = 1e-9": (
        "visco-elastic",
        {
            "initial.orientation": [0.0, NEAR - 1e-9, 0.0],
            "initial.angular_velocity": [0.0, -0.5, 0.0],
            "integration.range_bound": 1e-12,
            "integration.duration": 0.1,
        },
    ),
    "out of the range": (
        "visco-elastic",
        {"initial.orientation": [0.0, 1.5, 0.0], "initial.angular_velocity": [0.0, 9.0, 0.0]},
    ),
    "R = 0": ("visco-elastic", {"body.contact_point": diagonal(0.0)}),
    "R = 1e8 near rest": (
        "visco-elastic",
        {"body.contact_point": [1e8, 0.0, 0.0], "initial.angular_velocity": [1e-9, 0.0, 1e-9]},
    ),
    "near rest under a load": (
        "free",
        {
            "gravity": [0.0, 0.0, -1e3],
            "initial.position": [1e-6, 0.0, -12.5],
            "initial.angular_velocity": [0.0, 0.0, 1e-6],
        },
    ),
    "gravity 1e6": ("free", {"gravity": [0.0, 0.0, -1e6]}),
    "spin 1e6": ("free", {"initial.angular_velocity": [1e6, 1e6, 1e6]}),
    "K_s = 1e9": ("sliding", {"controller.K_s": diagonal(1e9)}),
    "K_s = 1e12 in a layer": (
        "sliding",
        {"controller.K_s": diagonal(1e12), "controller.law": "{boundary_layer: 1e-3}"},
    ),
    "K_s = 1e9 by implicit steps": (
        "sliding",
        {"controller.K_s": diagonal(1e9), "controller.law": "{implicit: 1e-2}"},
    ),
    "K_s = 1e9 on a slope": (
        "sliding",
        {"controller.K_s": diagonal(1e9), "controller.surface": "{slope: 20}"},
    ),
}


@pytest.mark.parametrize("case", sorted(SLOW_CASES))
def test_a_limit_of_steps_leaves_a_truthful_result(case):
    variant, changes = COMPARED[case]
    for engine in ENGINES:
        result = run(variant, engine, changes | {"integration.step_limit": 60})
        assert result.status in {"completed", *LIMITS}
        assert_truthful(result)


@pytest.mark.parametrize("case", [marked(case) for case in COMPARED])
def test_engines_agree_or_say_that_they_cannot_be_trusted(case):
    variant, changes = COMPARED[case]
    results = [run(variant, engine, changes) for engine in ENGINES]
    for result in results:
        assert result.status in {"completed", "range left", *LIMITS}
        assert_truthful(result)
    first, second = results
    # The last sample of a run that stopped early is at the time of its stop.
    count = min(len(r["time"]) - (r.status != "completed") for r in results)
    np.testing.assert_array_equal(first["time"][:count], second["time"][:count])
    if count and largest_difference(first, second, count) > ACCURACY:
        assert any(says_so(result) for result in results)
