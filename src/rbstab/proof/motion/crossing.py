"""Steps of motions whose elements switch: up to a surface g = 0, and across it.

In one mode a step is that of `step`, as long as no g may change its sign on it. Across a surface,
every motion, also one that grazes or slides, follows y' = f_m(y) + δ with |δ| at most the largest
|f_σ - f_m| in all modes σ that are possible there (A. Filippov, 1988: the field on a surface is a
mean of those beside it). That makes a hull. Where one g alone changes its sign, at a rate that
surely is not zero, each motion crosses once, after a time τ(y), and the hull is cut down by

    ỹ = y + Δ (τ - t)₊,    Δ near f_before - f_after:

ỹ' = f_after(ỹ) + δ with |δ| <= |∂f_after/∂y||Δ|h + |f_before - f_after - Δ|, and ỹ = y after τ. So
a step in the mode after it, from the set of all y + Δ τ(y), ends with the same states (the
saltation matrix: R. Leine and H. Nijmeijer, 2004).
"""

from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.equations import Equations, Possible
from rbstab.proof.motion.linear_flow import frames_of, turned_frames
from rbstab.proof.motion.models import Models, evaluated
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.program import Program
from rbstab.proof.motion.rounding import UNIT, error_of_products, rounded_up
from rbstab.proof.motion.step import TIME_GRID, Disturbance, SetSteps, set_steps
from rbstab.systems.modes import Modes

NEAR = 1e-10
"""s: how near to a surface a step in one mode ends."""

APART = 3.0
"""A step ends before a surface at this many times its error: in a tilted frame a set is larger than
its errors, and g is to have a sign in all of it."""

SHORTEST = 8 * TIME_GRID
"""s: the shortest step across a surface."""


def switching_step(
    equations: Equations, states: MotionSet, scale: Array, longest: Array
) -> tuple[SetSteps, Array, str]:
    """Prove one step of all motions from a set, the only one.

    Args:
        equations: The equations of a system that switches.
        states: The set.
        scale: The size of each state, shape (n,).
        longest: The largest step, shape (1,), s.

    Returns:
        The step, the largest one to be tried after it, and the name of the element whose surface
        the set has not left; empty if there is none.
    """
    possible = equations.possible(states.models)
    if all(len(choices) == 1 for choices in possible):
        (modes,) = product(*possible)
        field = equations.field(modes)
        step = set_steps(field, states, scale, longest)
        after = step.longest_after(longest)
        while step.proved[0]:
            if safe_time(equations, step, modes, states) == step.h[0]:
                return step, after, ""
            wide = step._replace(distance=APART * step.distance)
            safe = safe_time(equations, wide, modes, states)
            if safe <= NEAR:
                return _across(equations, states, possible, scale, after)
            step = set_steps(field, states, scale, np.array([safe]))
        return step, after, ""
    return _across(equations, states, possible, scale, longest)


def safe_time(equations: Equations, step: SetSteps, modes: Modes, states: MotionSet) -> float:
    """Return the time up to which each g surely has the sign of its mode, s, a multiple of 2⁻⁴⁰.

    Args:
        equations: The equations.
        step: A proved step in these modes, of one set.
        modes: The modes.
        states: The set at its beginning.
    """
    g = evaluated(equations.guards, step.tube(states.space))
    signs = np.array(modes)[:, np.newaxis, np.newaxis] * 2.0 - 1.0
    g = Models(g.space, g.polynomial * signs, g.remainder)
    h, pieces = float(step.h[0]), [(0.0, float(step.h[0]))]
    while pieces:
        begin, end = pieces.pop()
        low = _least(g, begin / h, end / h)
        if low > 0:
            continue
        if end - begin <= max(NEAR, SHORTEST):
            return begin
        middle = _on_grid((begin + end) / 2)
        pieces += [(middle, end), (begin, middle)]
    return h


def _least(g: Models, begin: float, end: float) -> float:
    """Return a lower bound on models, of one set, for begin <= τ <= end; rounded outwards."""
    coefficients = g.polynomial[:, :, 0, 0]
    terms = len(coefficients)
    # Powers of τ >= 0 do not fall.
    powers = np.array([begin, end])[:, np.newaxis, np.newaxis] ** np.arange(terms)[:, np.newaxis]
    low = (powers * coefficients).min(axis=0).sum(axis=0)
    aside = np.abs(g.polynomial[..., 0, 1:]).sum(axis=0).sum(axis=-1)
    rounding = (4 * terms + 8) * UNIT * g.size[:, 0]
    least = np.min(low - rounded_up(aside + rounding + g.remainder[:, 0]))
    return float(np.nextafter(least, -np.inf))


def _across(
    equations: Equations, states: MotionSet, possible: Possible, scale: Array, longest: Array
) -> tuple[SetSteps, Array, str]:
    """Prove a step across a surface, or along it."""
    now, which, rising, h = _next_switch(equations, states, possible, float(longest[0]))
    after = tuple(float(rising) if k == which else mode for k, mode in enumerate(now))
    upright = states.upright(scale)  # in a tilted frame, δ would leak into the other states
    jump = _disturbance(equations, after, states.models)
    hull = Disturbance(lambda tube: _disturbance(equations, after, tube), jump)
    while True:
        step = set_steps(equations.field(after), upright, scale, np.array([h]), hull)
        if step.proved[0] or h < 2 * SHORTEST:
            break
        h = _on_grid(h / 2)
    switch = equations.switches[which]
    if not step.proved[0]:
        return step, np.zeros(1), switch
    at_end = equations.possible(step.end.models)
    in_tube = equations.possible(step.tube(states.space))
    alone = all(len(choices) == 1 for k, choices in enumerate(in_tube) if k != which)
    crossed = possible[which] == (now[which],) and at_end[which] == (after[which],)
    if alone and crossed and now != after:
        step = _cut_down(equations, (now, after, which), states, step, scale)
    return step, longest, "" if all(len(choices) == 1 for choices in at_end) else switch


def _next_switch(
    equations: Equations, states: MotionSet, possible: Possible, longest: float
) -> tuple[Modes, int, bool, float]:
    """Return modes in a set, the number of the g that changes first, its sign then, and a time."""
    g = evaluated(equations.guards, states.models)
    low, high = (side[:, 0] for side in g.range())
    middle, wide = (low + high) / 2, (high - low) / 2
    now = tuple(
        choices[0] if len(choices) == 1 else float(m > 0)
        for choices, m in zip(possible, middle, strict=True)
    )
    best, which, rising = longest, int(np.argmin(np.abs(middle))), bool(middle.max() > 0)
    for k in range(len(now)):
        rates = evaluated(equations.crossing(now, now, k), states.models)
        rate = float(rates.polynomial[0, equations.size, 0, 0])
        towards = (rate > 0) == (middle[k] < 0)
        if rate == 0 or (len(possible[k]) == 1 and not towards):
            continue
        needed = 2.0 * ((abs(middle[k]) if towards else 0.0) + wide[k]) / abs(rate)
        if needed < best:
            best, which, rising = needed, k, rate > 0
    # An estimate, s, of when the whole set has left that surface.
    return now, which, rising, max(_on_grid(best) + 2 * TIME_GRID, SHORTEST)


def _disturbance(equations: Equations, modes: Modes, tube: Models) -> Array:
    """Bound |f_σ - f| for all modes σ that are possible in a tube, shape (1, n)."""
    bound = np.zeros((1, equations.size))
    for other in product(*equations.possible(tube)):
        if other != modes:
            bound = np.maximum(bound, evaluated(equations.difference(other, modes), tube).bound.T)
    return bound


def _cut_down(
    equations: Equations,
    switch: tuple[Modes, Modes, int],
    states: MotionSet,
    step: SetSteps,
    scale: Array,
) -> SetSteps:
    """Return a step across one surface with the smaller end that the saltation gives, or itself."""
    before, after, which = switch
    n, h = equations.size, float(step.h[0])
    program, field = equations.crossing(before, after, which), equations.field(after)
    tube = step.tube(states.space)
    on_tube = evaluated(program, tube)
    lows, highs = (side[n : n + 2, 0] for side in on_tube.range())
    if not (np.all(lows > 0) or np.all(highs < 0)):
        return step
    jump = on_tube.polynomial[0, :n, 0, 0]
    wide = tube.within(np.abs(jump)[:, np.newaxis] * h)
    slopes = np.zeros((n, n))
    slopes[field.places[0], field.places[1]] = evaluated(field.step, wide).bound[n:, 0]
    D = rounded_up(on_tube.variation[:n, 0] + rounded_up(slopes @ np.abs(jump)) * h)
    moved = _moved_start(program, states, jump, (lows[0], highs[0]), scale)
    left = Disturbance(lambda _: D[np.newaxis], D[np.newaxis])
    again = set_steps(field, moved, scale, step.h, left)
    better = again.proved[0] and again.h[0] == h
    # The tube is that of the motions themselves; only the end is the smaller one.
    return step._replace(end=again.end) if better else step


def _moved_start(
    program: Program,  # that of `Equations.crossing`
    states: MotionSet,
    jump: Array,  # Δ, shape (n,)
    rates: tuple[float, float],  # bounds on Ĝ, a mean of g' before the surface
    scale: Array,  # the size of each state, shape (n,)
) -> MotionSet:
    """Return a set of all y + Δ τ(y), with τ = -g(y)/Ĝ for y in a set before the surface."""
    n, (low, high), around = len(jump), rates, states.models
    G, error = (low + high) / 2, states.error[0]
    of_P = Models(states.space, around.polynomial, np.zeros_like(around.remainder))
    g, near = evaluated(program, of_P)[n + 2 : n + 3], evaluated(program, around)[n + 2 :]
    normal = near.polynomial[0, 1:, 0, 0]
    off = near.variation[1:, 0]
    # τ = -(g(P) + normal Qw)/G, and at most ρ beside it.
    inverse_error = 1.001 * max(high - G, G - low) / abs(G) / min(abs(low), abs(high)) + 4 * UNIT
    rho = near.bound[0, 0] * inverse_error + 1.001 * (off @ error + g.remainder[0, 0]) / abs(G)
    shift = jump[:, np.newaxis] * (-g.polynomial[0, 0, 0] / G)
    rounding = 6 * UNIT * (np.abs(states.polynomial[0]) + np.abs(shift)).sum(axis=-1)
    apart = rounded_up(np.abs(jump) * rounded_up(rho) + rounding)
    along = np.outer(jump, normal) / G
    matrix, size = np.eye(n) - along, np.eye(n) + np.abs(along)
    radii = (states.radius, apart[np.newaxis])
    turned = turned_frames(
        matrix[np.newaxis],
        error_of_products(size)[np.newaxis],
        frames_of(states.frame),
        radii,
        scale,
    )
    return MotionSet(states.space, states.polynomial + shift[np.newaxis], *turned)


def _on_grid(h: float) -> float:
    return float(np.floor(h / TIME_GRID) * TIME_GRID)
