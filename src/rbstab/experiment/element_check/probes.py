"""The statements of an element for every kind of number, and the balance of their powers.

For every motion of the body, stored' + dissipated = -(f'V + c'Ω + Λ'F), with the force f, the
couple c and the contact force Λ of the wrench. In stored' the own states have the stated rates. So
v falls by what is dissipated, as the theorem needs.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from rbstab.analysis.exact import balls, exact_system, exactly
from rbstab.elements.user_code.loaded import UserCode, failure, wrong_values
from rbstab.experiment.element_check.states import Sample, statements
from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.systems.system import System

SAME = 1e-11
"""The largest difference between kinds of number, relative to the largest value."""

DIFFERENCE = 1e-5
"""The step of central differences."""

SAME_SLOPE = 1e-6
"""The largest difference between slopes by a complex step and by differences, relative."""

TOLERANCE = 1e-12
"""The largest error of a balance, relative to the sum of the sizes of its terms."""

HINT = "use sin, cos, tan, atan, sqrt, exp, log, sinh, cosh, tanh and power of rbstab.elements"
COMPARED = (
    "it compares values, as max does; a force with a corner needs an element that switches, with "
    "`mode_count` and `guards`"
)
BRANCH = "does a statement branch on a value, or use abs, max, sign or where?"

ZEROS = {
    "X = 0": (X_OF_Z,),
    "Θ = 0": (THETA,),
    "Θ = 0 and X = 0": (THETA, X_OF_Z),
    "Ω = 0 and V = 0": (OMEGA, V_OF_Z),
}
"""States with zeros, as they are common at a start."""

UNITS = tuple(
    (f"a {motion} axis {axis}", place, k)
    for motion, place in (
        ("turn of 1 rad/s about the body", OMEGA),
        ("velocity of 1 m/s along the inertial", V_OF_Z),
    )
    for k, axis in enumerate("xyz")
)
"""Velocities of the body, each with its slice of Z and its index in it."""


def values(system: System, y: Array) -> Array:
    """Return all that the first element of a system states at a state, one after the other."""
    return np.concatenate(list(statements(system, y).values()))


def unusable(sample: Sample) -> Iterator[str]:
    """Yield what the statements return that is not finite, or not of the right type and shape."""
    wrong = list(wrong_values(sample.element, sample.motion, sample.element_states))
    yield from wrong
    for name, value in ({} if wrong else statements(sample.system, sample.y)).items():
        if not np.isfinite(value).all():
            yield f"`{name}` is not finite"


def timed(sample: Sample) -> Iterator[str]:
    """Yield a statement that depends on the time: only inputs may."""
    later = statements(sample.system, sample.y, 1.0)
    for name, value in statements(sample.system, sample.y).items():
        if np.any(value != later[name]):
            yield f"`{name}` depends on `motion.time`; only inputs of the program may"


def _kind(
    kind: str, hint: str, evaluate: Callable[[Sample], Array], code: UserCode, sample: Sample
) -> Iterator[str]:
    """Yield that a kind of number fails, or gives other values than floats."""
    try:
        same = _same(evaluate(sample), values(sample.system, sample.y))
    except Exception as error:
        hint = COMPARED if "not supported between" in str(error) else hint
        yield f"{kind} fail ({hint}): {failure(code, error)}"
        return
    if not same:
        yield f"{kind} give other values than floats ({BRANCH})"


def complex_problems(code: UserCode, sample: Sample) -> Iterator[str]:
    """Yield where complex numbers fail, or give another value or another slope."""
    at, y = partial(values, sample.system), sample.y
    yield from _kind("complex numbers", BRANCH, lambda _: at(y.astype(complex)), code, sample)
    direction = np.cos(np.arange(1.0, len(y) + 1.0))
    step = DIFFERENCE * direction
    # Central differences of fourth order.
    difference = 8.0 * (at(y + step) - at(y - step)) - (at(y + 2 * step) - at(y - 2 * step))
    difference /= 12.0 * DIFFERENCE
    size = np.abs(difference).max() + np.abs(at(y)).max() + 1.0
    if not np.abs(derivative_along(at, y, direction) - difference).max() <= SAME_SLOPE * size:
        yield (
            "the slope by a complex step is not that of differences "
            "(does a statement use abs, real or max, or an array of floats?)"
        )


def ball_problems(code: UserCode, sample: Sample) -> Iterator[str]:
    """Yield where the balls of python-flint fail, or give another value."""

    def middles(sample: Sample) -> Array:
        with exactly():
            enclosures = values(exact_system(sample.system), balls(sample.y)).tolist()
        return np.array([float(x.mid()) if hasattr(x, "mid") else float(x) for x in enclosures])

    return _kind("balls of python-flint", HINT, middles, code, sample)


def heyoka_problems(samples: Sequence[Sample], code: UserCode) -> Iterator[str]:
    """Yield where heyoka's expressions fail, give other values, or cannot start at a zero."""
    from rbstab.integrate.heyoka.compiled_map import Probe

    probe: Probe | None = None

    def compiled(sample: Sample) -> Array:
        nonlocal probe
        probe = probe or Probe(sample.system, values)
        return probe.values(sample.system, sample.y)

    for sample in samples:
        for problem in _kind("heyoka's expressions", HINT, compiled, code, sample):
            yield f"{problem}; {sample.words}"
    first = samples[0]
    for words, places in ZEROS.items():
        y = first.y.copy()
        for place in places:
            y[place] = 0.0
        startable = np.isfinite(first.system.rates(y)).all()
        if startable and probe is not None and not probe.steps_from(first.system, y):
            yield (
                f"heyoka cannot start where {words}: its series of x**n or sqrt(x) divides by x "
                "(use power(x, n), or a product; sqrt of what stays above 0)"
            )


def problems_of_velocities(sample: Sample) -> Iterator[str]:
    """Yield where the stored energy depends on velocities."""
    slopes = sample.stored_slopes
    for name, place in (("Ω", OMEGA), ("V", V_OF_Z)):
        if np.any(slopes[place] != 0.0):
            yield f"`stored` depends on the velocity {name}; only the body has kinetic energy"


def problems_at_rest(sample: Sample) -> Iterator[str]:
    """Yield where the wrench on a body at rest is not the slope of the stored energy."""
    rest = sample.resting
    wrench, slopes = statements(rest.system, rest.y)["wrench"], rest.stored_slopes
    worst, text = 0.0, ""
    for words, place, index in UNITS:
        y = rest.y.copy()
        y[place][index] = 1.0
        stored, given, size = _powers(rest._replace(y=y), wrench, slopes, 0.0)
        if abs(stored + given) > max(worst, TOLERANCE * size):
            worst = abs(stored + given)
            text = (
                f"the wrench on a body at rest is not the slope of `stored`: with {words}, "
                f"`stored` changes by {stored:.6g} W, and `wrench` gives {given:.6g} W to the "
                "body (their sum must be 0)"
            )
    if text:
        yield text


def problems_in_motion(sample: Sample) -> Iterator[str]:
    """Yield where the power balance of a moving body fails, or the dissipation is negative."""
    stated = statements(sample.system, sample.y)
    (dissipated,), rates = stated["dissipated"], stated.get("rates", 0.0)
    stored, given, size = _powers(sample, stated["wrench"], sample.stored_slopes, rates)
    size += abs(dissipated)
    error = stored + dissipated + given
    if not abs(error) <= TOLERANCE * size:
        blamed = ", or `rates` is wrong" if sample.element.state_size else ""
        yield (
            f"`dissipated` is not the power that `wrench` takes from the motion{blamed}: `stored` "
            f"changes by {stored:.6g} W, `dissipated` is {dissipated:.6g} W, and `wrench` gives "
            f"{given:.6g} W to the body (their sum must be 0, and is {error:.6g} W)"
        )
    if not dissipated >= -TOLERANCE * size:
        yield f"`dissipated` is negative: {dissipated:.6g} W; such an element is not passive"


def _powers(
    sample: Sample, wrench: Array, slopes: Array, element_rates: Array | float
) -> tuple[float, float, float]:
    """Return the rate of the stored energy, the power of the wrench, and the size of both, W."""
    # Along the motion of the sample, with all accelerations zero.
    motion, rates = sample.motion, np.zeros(len(sample.y))
    rates[THETA], rates[X_OF_Z] = motion.B @ motion.Omega, motion.V
    rates[sample.system.coordinates.size :] = element_rates
    stored, given = slopes * rates, wrench * np.concatenate([motion.V, motion.Omega, motion.F])
    # The sum of the sizes of all terms; it is above 0.
    size = np.abs(stored).sum() + np.abs(given).sum() + np.finfo(float).tiny
    return float(stored.sum()), float(given.sum()), float(size)


def _same(computed: Array, expected: Array) -> bool:
    size = max(float(np.abs(expected).max()), 1e-300)
    return bool(np.abs(computed - expected).max() <= SAME * size)
