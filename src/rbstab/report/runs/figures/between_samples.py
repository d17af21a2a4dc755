"""The rotation of a run between its samples: cubics through states and rates."""

from typing import NamedTuple

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.user_code.permission import has_code
from rbstab.mechanics.motion import motion_from_centre
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA
from rbstab.report.reading.sources import Run
from rbstab.systems.system import System

POINTS = 8
"""Number of parts into which an interval between samples is divided."""

SHARES = np.arange(1, POINTS) / POINTS
"""The points inside an interval, as shares of it."""

MAX_SAMPLES = 1500
"""With more samples, straight lines between them look like curves already."""

CHECKED_AT = 0.5 - np.sqrt(3.0) / 6.0
"""Where the defect of a cubic is computed, as a share of its interval. Its leading error is
c s²(1 - s)², whose slope is largest there, and zero in the middle."""

MAX_DEFECT = 0.05
"""A cubic is drawn if its defect times the length of its interval is at most this share of the
range of each component. Its leading error is a third of that."""

VISIBLE = 1e-3
"""Points between samples are drawn if they are this share of the range off the straight line."""

STATES = np.r_[THETA, OMEGA]
"""The indices of Θ and Ω in a state vector; they are the same in all coordinates."""


class Path(NamedTuple):
    """Θ and Ω along a run, for drawing.

    Attributes:
        orientation: Θ, shape (n, 3), rad.
        angular_velocity: Ω, shape (n, 3), rad/s.
        cubics: Number of intervals between samples that are drawn as cubics.
        intervals: Number of all intervals.
    """

    orientation: Array
    angular_velocity: Array
    cubics: int
    intervals: int


def path_between_samples(run: Run) -> Path:
    """Return the rotation of a run, interpolated between its samples.

    In each interval this is the cubic Hermite polynomial through both states and both rates
    ẏ = f(t, y). It is drawn only if it obeys the equations of motion: if its defect ẏ - f(t, y) is
    small. Otherwise the samples are joined by a straight line. So are
    those of runs whose equations change at events, or are not known here.
    """
    samples = np.hstack([run.result["orientation"], run.result["angular_velocity"]])
    intervals = len(samples) - 1
    with np.errstate(all="ignore"):
        found = _cubics(run, samples)
    if found is None:
        return Path(samples[:, :3], samples[:, 3:], 0, intervals)
    cubics, drawn = found
    visible = VISIBLE * np.ptp(samples, axis=0)
    parts = []
    for number in range(intervals):
        parts.append(samples[number : number + 1])
        if drawn[number]:
            inner = _at(cubics[:, number], SHARES[:, np.newaxis])
            straight = samples[number] + SHARES[:, np.newaxis] * np.diff(
                samples[[number, number + 1]], axis=0
            )
            if (np.abs(inner - straight) > visible).any():
                parts.append(inner)
    path = np.concatenate([*parts, samples[-1:]])
    return Path(path[:, :3], path[:, 3:], int(drawn.sum()), intervals)


def _cubics(run: Run, samples: Array) -> tuple[Array, Array] | None:
    """Return the cubics of Θ and Ω in all intervals, and which of them are drawn.

    A cubic is its coefficients by the share of the interval, shape (4, intervals, 6).
    """
    system, times = smooth_system(run), run.result["time"]
    if system is None or not 2 <= len(times) <= MAX_SAMPLES:
        return None
    states = _states(run, system)
    if states is None or not np.isfinite(states).all():
        return None
    rates = np.array([system.rates(y, t) for y, t in zip(states, times.tolist(), strict=True)])
    lengths = np.diff(times)[:, np.newaxis]
    change, first, last = np.diff(states, axis=0), lengths * rates[:-1], lengths * rates[1:]
    cubics = np.array(
        [states[:-1], first, 3.0 * change - 2.0 * first - last, first + last - 2.0 * change]
    )
    s = CHECKED_AT
    slopes = cubics[1] + s * (2.0 * cubics[2] + s * 3.0 * cubics[3])
    inside = times[:-1] + s * np.diff(times)
    points = zip(_at(cubics, s), inside.tolist(), strict=True)
    expected = np.array([system.rates(*point) for point in points])
    defect = np.abs(slopes - lengths * expected)[:, STATES]
    drawn = (defect <= MAX_DEFECT * np.ptp(samples, axis=0)).all(axis=1)
    return cubics[..., STATES], drawn


def _at(cubics: Array, s: Array | float) -> Array:
    """Return the values of cubics, given their coefficients, at shares of their intervals."""
    a, b, c, d = cubics
    return np.asarray(a + s * (b + s * (c + s * d)))


def smooth_system(run: Run) -> System | None:
    """Return the equations of a run; None if they change at events, or are not known here."""
    # A stored result must not run code of a user.
    if run.config is None or has_code(run.config):
        return None
    problem = problem_of(run.config)
    elements = problem.system.elements
    changes = any(element.slides or element.holds for element in elements)
    if changes or problem.switching is not None or problem.schedule is not None:
        return None
    return problem.system


def _states(run: Run, system: System) -> Array | None:
    """Return the state vectors of the samples; None if the file lacks own states of elements."""
    own = list(system.own_states)
    if any(name not in run.result for name in own):
        return None
    names = ("orientation", "angular_velocity", "position", "velocity")
    samples = np.hstack([run.result[name] for name in (*names, *own)])
    return np.array(
        [system.start(motion_from_centre(system.body, system.anchor, Z), Z[12:]) for Z in samples]
    )
