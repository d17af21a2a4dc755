"""Runs for the figures and tables of docs/sliding.md."""

from functools import cache
from pathlib import Path

import numpy as np

import rbstab

EXAMPLES = Path(__file__).parents[2] / "configs" / "examples" / "sliding"

PERMANENT = EXAMPLES.parents[1] / "paper" / "case1_permanent.yaml"
PERMANENT_OPTIONS = (
    "controller.L_t=[200, 200, 140]",
    "integration.duration=0.2",
    "integration.samples=401",
    "integration.engine=heyoka",
)
"""Options for the body of the examples with its contact point held from the start."""

STEPS = ("1.0e-3", "5.0e-4", "2.0e-4", "1.0e-4", "5.0e-5", "2.0e-5", "1.0e-5")
"""Steps of the implicit law, s, as printed on the page."""

BALL_STEPS = STEPS[:4]
"""Steps for the ball, which takes longest."""

BOUNDS = (100, 30, 10)
"""Values of `stick_energy`, J. With 1 J the run of one start in five takes up to two minutes."""


def start(k: int) -> str:
    """Return the paper's start with one number changed by `k` units in its last place."""
    return f"initial.angular_velocity=[{16 + k * float(np.spacing(16.0))!r}, 32, -16]"


STARTS = tuple(start(k) for k in (0, 1, 2, -1, -2))
"""The paper's start, and starts that differ from it in the last digit of one number."""

MANY_STARTS = tuple(start(k) for k in range(-9, 11))
"""As many as the time of sticking needs: in one in five it is late."""

CHATTER_END = 1.6
"""End of the runs with chatter, s; one more second has a million times as many switches."""

BALL = {"mass": 41, "K_s": 20000, "height": 0.2}
"""kg, N, m: a body held at its centre of gravity, which is a ball in a V on each axis."""


@cache
def run(name: str, *overrides: str) -> rbstab.Result:
    """Return the result of an example with some of its values replaced."""
    return rbstab.simulate(rbstab.load_config(EXAMPLES / f"{name}.yaml", list(overrides)))


def span(duration: float, samples: int) -> tuple[str, str]:
    """Return overrides for the simulated time."""
    return f"integration.duration={duration}", f"integration.samples={samples}"


def chattering(K_s: int, begin: str = STARTS[0]) -> rbstab.Result:
    """Return a run of eq. 39 with exact switching and without sticking."""
    duration = span(CHATTER_END, 321) if K_s == 2000 else span(1.4, 281)
    return run(f"position_exact_{K_s}", "controller.stick_energy=0", begin, *duration)


@cache
def sticking_at(bound: int) -> tuple[rbstab.Result, ...]:
    """Return runs of eq. 39 with exact switching and sticking below a chatter energy."""
    sticking = f"controller.stick_energy={bound}"
    return tuple(run("position_exact_20000", sticking, begin) for begin in MANY_STARTS)


def stepped(surface: str, step: str) -> rbstab.Result:
    """Return a run with implicit steps, K_s = 20000 N."""
    duration = span(1.0, 201) if surface == "position" else span(0.1, 21)
    return run(f"{surface}_implicit_20000", f"controller.law.implicit={step}", *duration)


@cache
def stepped_ball(step: str) -> rbstab.Result:
    """Return a run of a ball in a V from rest, with implicit steps; only the steps damp it."""
    negligible, x = [1e-9] * 3, BALL["height"]
    # Samples are 10 ms apart, a whole number of steps; otherwise the steps would be shorter.
    intervals = round(150 * ball_time(float(step)))
    controller = {"variant": "sliding", "K_s": [BALL["K_s"]] * 3, "surface": "position"}
    controller["law"] = {"implicit": float(step)}
    end = {"duration": intervals / 100, "samples": intervals + 1}
    return rbstab.simulate(
        {
            "body": {"mass": BALL["mass"], "inertia": [1, 1, 1], "contact_point": [0, 0, 0]},
            "controller": controller | dict.fromkeys(("K_t", "L_t", "K_r", "L_r"), negligible),
            "initial": {"position": [x, x, x]},
            "integration": {**end, "engine": "heyoka"},
        }
    )


def ball_time(step: float) -> float:
    """Return x/(hk), s, the time at which implicit steps make a ball that falls from x stick."""
    return BALL["height"] * BALL["mass"] / (step * BALL["K_s"])


def stuck_from(result: rbstab.Result) -> float:
    """Return the time of the last stick, s; after it every axis is held to the end of the run."""
    assert not result["mode"][-1].any() or result["transition_kind"][-1] == "stick"
    return float(result["transition_time"][-1])


def reflected_damping() -> np.ndarray:
    """Return the stabilizers' damping at C of the body at Θ = 0, shape (3, 3), 1/s.

    An impulse p at C gives the body the velocities p/m and J⁻¹Řp, and C the velocity F = Wp. L_t
    and L_r take p'Sp from it each second, so Ḟ = -SW⁻¹F. The formula is repeated here, independent
    of the program, so that the slopes in the figure are predictions.
    """
    m, J, R = 41.0, np.array([10.0, 8.0, 0.4]), np.array([0.15, 0.10, -0.42])
    L_t, L_r = np.diag([200.0, 200.0, 140.0]), np.diag([60.0, 60.0, 42.0])
    cross = np.cross(R, np.eye(3)).T
    turning = cross / J[:, None]
    W = np.eye(3) / m + cross.T @ turning
    return (L_t / m**2 + turning.T @ L_r @ turning) @ np.linalg.inv(W)


def growth(times: np.ndarray, values: np.ndarray, begin: float, end: float) -> float:
    """Return the rate of growth of a positive quantity between two times, 1/s (least squares)."""
    used = (times >= begin) & (times <= end) & (values > 0)
    return float(np.polyfit(times[used], np.log(values[used]), 1)[0])


def predicted_rates() -> dict[str, tuple[float, float]]:
    """Return bounds for the rates of the late chatter, 1/s, from the damping alone."""
    d = reflected_damping()
    third, others = d[2, 2], np.sort(np.linalg.eigvals(d[:2, :2]).real)
    return {
        "e": (-2 * third / 3, -2 * third / 3),
        "switches, axis 3": (third / 3, third / 3),
        "switches, axes 1 and 2": (others[0] / 3, others[1] / 3),
    }


def measured_rates(result: rbstab.Result) -> tuple[float, float, float]:
    """Return the rates of `predicted_rates`, measured in one run."""
    t, count = result["time"], np.diff(result["switch_count"], axis=0)
    # Count crossings in a tenth of a second: in a single sample axis 3 has one or none.
    counts, begins = np.add.reduceat(count, np.arange(0, len(count), 20)), t[:-1:20]
    return (
        growth(t, result["chatter_energy"], 1.0, CHATTER_END),
        growth(begins, counts[:, 2], 0.8, CHATTER_END),
        growth(begins, counts[:, :2].sum(axis=1), 1.0, CHATTER_END),
    )


def neighbours() -> tuple[rbstab.Result, rbstab.Result]:
    """Return two runs on s = E whose starts differ in one last digit, K_s = 20000 N."""
    options = ("controller.stick_energy=0", *span(0.6, 1201))
    first, second = (run("position_exact_20000", *options, begin) for begin in STARTS[:2])
    return first, second


def error_growth() -> float:
    """Return the growth of the logarithm of their difference per switch, up to `trusted_until`."""
    first, second = neighbours()
    apart = np.abs(first["contact_velocity"] - second["contact_velocity"]).max(axis=1)
    used = np.flatnonzero((first["time"] <= first["trusted_until"]) & (apart > 0))
    switches = first["switch_count"][used[-1]].sum()
    return float(np.log(apart[used[-1]] / apart[used[0]]) / switches)


def at(times: np.ndarray, values: np.ndarray, time: float) -> float:
    """Return the value at the sample nearest to a time."""
    return float(values[np.abs(times - time).argmin()])
