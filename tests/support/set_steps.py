"""Steps of random sets of motions, the parts of a step to be proved, and when steps are equal."""

from functools import cache, partial
from itertools import product

import numpy as np
from flint import ctx

from rbstab.analysis.exact import decimal_balls
from rbstab.analysis.motion_proof.linear_flow import frames_of
from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets import set_step as step_module
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.set_step import (
    FOR_SETS,
    _Steps,
    set_steps,
)
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from support.exact_motions import state_after
from support.polynomial_sets import BITS, place_in_frame, state_of
from support.start_sets import random_config, random_set

LONGEST = 0.0039
"""s: no power of 2, so that products with it are rounded."""


@cache
def equations(config):
    with proof_precision():
        return equations_of(partial(enclosed_system, config))


@cache
def exact_system(config):
    with ctx.workprec(BITS):
        return enclosed_system(config, decimal_balls)


def stepped(config, states, scale, longest=LONGEST):
    step = tried(config, states, scale, longest)
    assert step.proved.all()
    return step


def tried(config, states, scale, longest=LONGEST, orders=FOR_SETS):
    """Return steps that may not be proved; `longest` is a number, or one for each set."""
    with proof_precision():
        longest = np.full(len(states), longest)
        return set_steps(equations(config), states, scale, longest, orders)


def ends(config, states, step, starts):
    """Yield the place of exact ends in the frame at the end, relative to its radii."""
    for z, w in starts:
        y = state_of(states, z.tolist(), w.tolist())
        end = state_after(exact_system(config), y, float(step.h[0]))
        yield place_in_frame(step.end, z.tolist(), end) / step.end.radius[0]


def a_step(variant="visco-elastic", coordinates="Z", *, width=1e-2, error=1e-5, orders=FOR_SETS):
    """Return a step of one set that is to be proved, and the equations in doubles."""
    longest = LONGEST if orders is FOR_SETS else 3 * LONGEST
    config = random_config(variant, coordinates, 5)
    states, scale = random_set(config, 7, width=width, error=error)
    with proof_precision():
        h, p = step_module._polynomial(
            equations(config), states, scale, np.array([longest]), orders.order
        )
    margin = step_module.GROWTH * states.error + step_module.MARGIN * scale
    frame = frames_of(states.frame)
    step = _Steps(equations(config), states.space, frame, scale, h, p, margin, orders)
    return step, enclosed_system(config, lambda values: values)


def p_at(step, z, tau):
    """Return p at z and τ, which may be complex."""
    monomials = np.prod(np.array(z) ** np.array(step.space.exponents), axis=1)
    powers = tau ** np.arange(step.p.shape[-1])
    return np.einsum("imk,m,k->i", step.p[0], monomials, powers)


def corners_of_z(step):
    return [np.array(z) for z in product((-1.0, 0.3, 1.0), repeat=step.space.variables)]


def assert_equal(many, k, one, j):
    """Check that two steps are the same, bit for bit."""
    assert many.h[k] == one.h[j]
    assert many.proved[k] == one.proved[j]
    for name in ("polynomial", "frame", "radius"):
        assert np.array_equal(getattr(many.end, name)[k], getattr(one.end, name)[j]), name
