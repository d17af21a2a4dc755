"""Steps of random sets of motions, and the exact ends of some of their starts."""

from functools import cache, partial
from itertools import product

import numpy as np
from flint import ctx

from rbstab.analysis.exact import decimal_balls
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.proof.motion.equations import Equations
from rbstab.proof.motion.step import set_steps
from support.exact_motions import state_after
from support.polynomial_sets import BITS, place_in_frame, state_of

LONGEST = 0.0039
"""s: no power of 2, so that products with it are rounded."""


@cache
def equations(config):
    return Equations(partial(enclosed_system, config))


@cache
def exact_system(config):
    with ctx.workprec(BITS):
        return enclosed_system(config, decimal_balls)


def tried(config, states, scale, longest=LONGEST):
    """Return steps that may not be proved; `longest` is a number, or one for each set."""
    return set_steps(equations(config).field(), states, scale, np.full(len(states), longest))


def stepped(config, states, scale, longest=LONGEST):
    step = tried(config, states, scale, longest)
    assert step.proved.all()
    return step


def some_starts(states, count, seed=0):
    """Return random corners of a set, and points inside, as z and w."""
    rng, n = np.random.default_rng(seed), states.radius.shape[1]
    corners = [np.array(z) for z in product((-1.0, 1.0), repeat=states.space.variables)]
    starts = []
    for k in range(count):
        z = corners[k % len(corners)] if k % 3 else rng.uniform(-1, 1, states.space.variables)
        starts.append((z, rng.choice([-1.0, 1.0], n) * states.radius[0]))
    return starts


def ends(config, states, step, starts):
    """Yield the place of exact ends in the frame at the end, relative to its radii."""
    for z, w in starts:
        y = state_of(states, z.tolist(), w.tolist())
        end = state_after(exact_system(config), y, float(step.h[0]))
        yield place_in_frame(step.end, z.tolist(), end) / step.end.radius[0]


def assert_equal(many, k, other, j):
    """Check that two steps are the same, bit for bit."""
    assert many.h[k] == other.h[j]
    assert many.proved[k] == other.proved[j]
    for name in ("polynomial", "frame", "radius"):
        assert np.array_equal(getattr(many.end, name)[k], getattr(other.end, name)[j]), name
