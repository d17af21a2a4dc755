"""The statements of an element for every kind of number that the program puts into them."""

from collections.abc import Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from rbstab.analysis.exact import balls, exact_system, in_balls
from rbstab.elements.user_code.loaded import UserCode, failure
from rbstab.experiment.element_check.states import Sample, own_in
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.motion import Wrench
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.systems.system import System

SAME = 1e-11
"""The largest difference between kinds of number, relative to the largest value."""

DIFFERENCE = 1e-5
"""The step of central differences."""

SAME_SLOPE = 1e-6
"""The largest difference between slopes by a complex step and by differences, relative."""

NO_STATE = np.zeros(0)

HINT = "use sin, cos, tan, atan, sqrt, exp, log, sinh, cosh, tanh and power of rbstab.elements"
COMPARED = (
    "it compares values, as max does; a force with a corner needs an element that switches, with "
    "`mode_count` and `guards`"
)
BRANCH = "does a statement branch on a value, or use abs, max, sign or where?"


def values(system: System, y: Array) -> Array:
    """Return all that the first element of a system states at a state, one after the other."""
    element, motion, own = system.elements[0], system.motion(y), own_in(system, y)
    wrench: Wrench = element.wrench(motion, own)
    energies = [element.stored(motion, own), element.dissipated(motion, own)]
    guards = element.guards(motion, own) if element.mode_count else NO_STATE
    rates = element.rates(motion, own) if element.state_size else NO_STATE
    return np.concatenate([*wrench, np.array(energies), guards, rates])


def complex_problems(samples: Sequence[Sample], code: UserCode) -> Iterator[str]:
    """Yield where complex numbers fail, or give another value or another slope."""
    for sample in samples:
        expected = values(sample.system, sample.y)
        try:
            found = values(sample.system, sample.y.astype(complex))
            at = partial(values, sample.system)
            slope = derivative_along(at, sample.y, _direction(sample))
        except Exception as error:
            yield f"complex numbers fail ({BRANCH}): {failure(code, error)}; {sample.words}"
            return
        if not _same(found, expected):
            yield f"complex numbers give other values than floats ({BRANCH}); {sample.words}"
            return
        difference = _difference(sample)
        size = np.abs(difference).max() + np.abs(expected).max() + 1.0
        if not np.abs(slope - difference).max() <= SAME_SLOPE * size:
            yield (
                "the slope by a complex step is not that of differences "
                f"(does a statement use abs, real or max, or an array of floats?); {sample.words}"
            )
            return


def ball_problems(samples: Sequence[Sample], code: UserCode) -> Iterator[str]:
    """Yield where the balls of python-flint fail, or give another value."""
    for sample in samples:
        found = in_balls(partial(_in_balls, sample))
        if isinstance(found, Exception):
            yield f"balls of python-flint fail ({HINT}): {failure(code, found)}; {sample.words}"
            return
        if not _same(found, values(sample.system, sample.y)):
            yield f"balls of python-flint give other values than floats ({BRANCH}); {sample.words}"
            return


def _in_balls(sample: Sample) -> Array | Exception:
    """Return the values at a state, computed in balls; or their error, which may be any."""
    try:
        exact = values(exact_system(sample.system), balls(sample.y))
        return np.array([_middle(entry) for entry in exact])
    except Exception as error:
        return error


def heyoka_problems(samples: Sequence[Sample], code: UserCode) -> Iterator[str]:
    """Yield where heyoka's expressions fail, give other values, or cannot start at a zero."""
    if find_spec("heyoka") is None:
        return
    from rbstab.integrate.heyoka.compiled_map import Probe

    first = samples[0]
    try:
        probe = Probe(first.system, values)
    except Exception as error:
        hint = COMPARED if "not supported between" in str(error) else HINT
        yield f"heyoka's expressions fail ({hint}): {failure(code, error)}"
        return
    for sample in samples:
        if not _same(probe.values(sample.system, sample.y), values(sample.system, sample.y)):
            yield f"heyoka's expressions give other values than floats ({BRANCH}); {sample.words}"
            return
    for words, places in _ZEROS.items():
        y = first.y.copy()
        for place in places:
            y[place] = 0.0
        if np.isfinite(first.system.rates(y)).all() and not probe.steps_from(first.system, y):
            yield (
                f"heyoka cannot start where {words}: its series of x**n divides by x "
                "(use power(x, n), or a product)"
            )
            return


_ZEROS = {
    "X = 0": (X_OF_Z,),
    "Θ = 0": (THETA,),
    "Θ = 0 and X = 0": (THETA, X_OF_Z),
    "Ω = 0 and V = 0": (OMEGA, V_OF_Z),
}
"""States with zeros, as they are common at a start."""


def is_traced(sample: Sample) -> bool:
    """Return whether SciPy's engine evaluates the element by code made from it, which is fast."""
    line = StraightLine(values, sample.system, sample.system.size)
    return line.finite_value(sample.y) is not None


def has_heyoka() -> bool:
    """Return whether heyoka is installed."""
    return find_spec("heyoka") is not None


def _direction(sample: Sample) -> Array:
    return np.cos(np.arange(1.0, len(sample.y) + 1.0))


def _difference(sample: Sample) -> Array:
    """Return the slope of the values by central differences, of fourth order."""
    step = DIFFERENCE * _direction(sample)

    def at(k: int) -> Array:
        return values(sample.system, sample.y + k * step)

    slope: Array = (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * DIFFERENCE)
    return slope


def _middle(entry: Any) -> float:
    """Return the middle of a ball, or a float as it is."""
    return float(entry.mid()) if hasattr(entry, "mid") else float(entry)


def _same(found: Array, expected: Array) -> bool:
    size = max(float(np.abs(expected).max()), 1e-300)
    return bool(np.abs(found - expected).max() <= SAME * size)
