"""One step of a proved motion: from a set that holds the state to such a set a step later.

The set is a parallelepiped {ȳ + Qw : |w| <= ω}: a centre, a frame, and radii in the frame
(R. Lohner). On the step, y(t) = p(t) + e(t) with a polynomial p and, in τ = t/h,

    e' = h (f(p + e) - f(p)) + h d,    d = f(p) - ṗ,    e(0) = Qw.

Here ' is d/dτ, and ṗ is dp/dt.

Φ and Ψ are polynomials in τ near the fundamental matrix of e' = hJe and its inverse, with J = ∂f/∂y
along p. With w(τ) = Q⁻¹Ψe,

    w' = Q⁻¹(Ψ' + hΨJ)e + hQ⁻¹Ψ((J̄ - J)e + d),    e = ΦQw + (I - ΦΨ)e,

where J̄ is the mean of ∂f/∂y between p and p + e. The first bracket and I - ΦΨ are small, because Φ
and Ψ are good; J̄ - J is small, because e is. A, C and G bound |Q⁻¹| ∫|Ψ' + hΨJ|, |Q⁻¹Ψ|, |J̄ - J|.
Then the error is below b on the whole step, and |w| is at most W, as soon as

    W = ω + A b + hC (G b + |d|),    |ΦQ| W + |I - ΦΨ| b < b

in every component: e is continuous, starts below b, and cannot be the first to reach it.
`docs/proofs.md` has the proof.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.expansion import Expansion
from rbstab.analysis.motion_proof.linear_flow import (
    Frame,
    LinearBounds,
    LinearFlow,
    frame_of,
    frames_of,
    linear_bounds,
    linear_flow,
)
from rbstab.analysis.motion_proof.rounding import (
    all_moderate,
    error_of_products,
    magnitude_of,
    rounded_up,
)
from rbstab.analysis.motion_proof.taylor import (
    Coefficients,
    DiscBounds,
    Field,
    defect,
    disc_bounds,
    jacobian_series,
    step_for,
)
from rbstab.mechanics.numbers import Array

RATIO = 3.0
"""ρ: Cauchy's estimates hold for complex times up to ρh."""

MAX_LAST_TERM = 1e-6
"""The allowed norm of the last term of Φ, in scaled states. It decides the length of a step where
the system is stiff and its motion slow."""

MARGIN = 1e-4
"""The distance from p within which ∂f/∂y is bounded, relative to the scale of a state."""

MAX_SPREAD = 1e-2
"""The largest |e| that is accepted, relative to that distance."""

ATTEMPTS = 12
"""Attempts to find the bound b of one step."""

TIME_GRID = 2.0**-40
"""s: steps are multiples of this, so that the times of many steps are sums without rounding."""


@dataclass(frozen=True, eq=False)
class StateSet:
    """A set of states {ȳ + Qw : |w| <= ω}.

    Args:
        centre: ȳ, exact balls, one for each state.
        frame: Q, shape (n, n), doubles.
        radius: ω, shape (n,).
    """

    centre: list[Any]
    frame: Array
    radius: Array

    @property
    def spread(self) -> Array:
        """A bound on |y - ȳ| by state, shape (n,)."""
        spread: Array = rounded_up(np.abs(self.frame) @ self.radius)
        return spread


@dataclass(frozen=True, eq=False)
class Step:
    """A proved step: for 0 <= t <= h each state is within its `distance` of p(t).

    Args:
        h: Its length, s.
        p: The coefficients of p.
        distance: b, shape (n,).
        end: The set that holds the state at t = h.
    """

    h: float
    p: Coefficients
    distance: Array
    end: StateSet


class _ErrorBounds(NamedTuple):
    """b and W: bounds on |e| and on |w| for the whole step, each of shape (n,)."""

    distance: Array
    in_frame: Array


def step_from(
    field: Field,
    start: StateSet,
    scale: Array,
    longest: float,
    expansion: Expansion | None = None,
) -> Step | None:
    """Prove one step from a set of states.

    Args:
        field: f.
        start: The set.
        scale: The size of each state, shape (n,); the choice has no effect on what is proved.
        longest: The largest step, s.
        expansion: The expansion of f about the centre of the set; default a new one, `NARROW`.

    Returns:
        The step; None if no bounds were found: a shorter step may succeed.
    """
    frame = frame_of(start.frame)
    if frame is None:
        return None
    expansion = expansion or Expansion(field, start.centre)
    try:
        p = expansion.p
        h = _on_grid(min(step_for(p, expansion.accuracy.tolerance, scale), longest))
        margin = MARGIN * scale
        bounds = disc_bounds(field, p, h, RATIO, margin)
        if h <= 0 or not bounds.finite:
            return None
        flow, ratio = _flow(expansion, h, bounds, scale)
        if flow.h <= 0 or not _is_moderate(flow, frame, bounds):
            return None
        d = defect(field, p, flow.h, ratio, bounds)
    except ZeroDivisionError:  # a series whose first coefficient may be zero has no inverse
        return None
    linear = linear_bounds(flow, frame)
    errors = _error_bounds(linear, start.radius, flow.h * d, flow.h * bounds.jacobian, margin)
    if errors is None:
        return None
    end = _end(p, flow, frame, errors, rounded_up(linear.mismatch @ errors.distance), scale)
    return None if end is None else Step(flow.h, p, errors.distance, end)


def _is_moderate(flow: LinearFlow, frame: Frame, bounds: DiscBounds) -> bool:
    """Return whether the bounds on rounding errors hold for all matrices of a step."""
    of_flow = (flow.forward, flow.backward, flow.J.middle, flow.J.rest)
    return all_moderate(frame.matrix, frame.inverse, bounds.jacobian, *of_flow)


def _on_grid(h: float) -> float:
    return float(np.floor(h / TIME_GRID)) * TIME_GRID


def _flow(
    expansion: Expansion, h: float, bounds: DiscBounds, scale: Array
) -> tuple[LinearFlow, float]:
    """Return Φ and Ψ of a step of at most h, and the ratio ρ of the disc to it."""
    slopes, terms = expansion.slopes, expansion.accuracy.jacobian_terms
    flow = linear_flow(jacobian_series(slopes, terms, h, RATIO, bounds), h)
    last = float(flow.last_term(scale))
    if not last > MAX_LAST_TERM:
        return flow, RATIO
    shorter = _on_grid(h * (MAX_LAST_TERM / last) ** (1.0 / terms))
    # The disc stays as it is, so the shorter step has a larger ratio; it is rounded down.
    ratio = RATIO * h / shorter * (1.0 - 1e-12) if shorter > 0 else RATIO
    J = jacobian_series(slopes, terms, shorter, ratio, bounds)
    return linear_flow(J, shorter), ratio


def _error_bounds(
    linear: LinearBounds, radius: Array, hd: Array, hM: Array, margin: Array
) -> _ErrorBounds | None:
    """Return b and W with proved |e| < b and |w| <= W on the whole step; None if none were found.

    For |e| <= s times the margin, Schwarz's lemma gives |∂f/∂y(p + σe) - ∂f/∂y(p)| <= 2 M s σ: as a
    function of a complex factor of e, the difference is analytic, zero at zero, and at most 2M
    within the margin. So its mean over 0 <= σ <= 1 is at most G = M s.

    Args:
        linear: The bounds of the linear part.
        radius: ω, shape (n,).
        hd: h times the bound on |d|, shape (n,).
        hM: h times the bound on |∂f/∂y| within the margin, shape (n, n).
        margin: The margin, shape (n,).
    """
    guess = rounded_up(linear.forward @ (radius + linear.backward @ hd))
    for _ in range(ATTEMPTS):
        b = 1.1 * guess + 1e-240
        s = float(rounded_up(np.max(b / margin)))
        if not s < MAX_SPREAD:
            return None
        nonlinear = rounded_up(hM @ b) * s
        W = rounded_up(radius + linear.residual @ b + linear.backward @ (nonlinear + hd))
        reached = rounded_up(linear.forward @ W + linear.mismatch @ b)
        if np.all(reached < b):
            return _ErrorBounds(b, W)
        guess = np.maximum(guess, reached)
    return None


def _end(  # noqa: PLR0913, PLR0917 (the parts of one formula)
    p: Coefficients,
    flow: LinearFlow,
    frame: Frame,
    errors: _ErrorBounds,
    mismatch: Array,
    scale: Array,
) -> StateSet | None:
    """Return the set at the end in a new frame: p(h) + Φ(1)Qw + (I - ΦΨ)e.

    Args:
        p: The polynomial.
        flow: Φ and Ψ.
        frame: Q.
        errors: b and W.
        mismatch: A bound on |(I - ΦΨ)e|, shape (n,).
        scale: The size of each state, shape (n,).
    """
    centre, rounding = _value(p, flow.h)
    moved = moved_frame(flow, frame, errors.in_frame, mismatch + rounding, scale)
    return None if moved is None else StateSet(centre, *moved)


def moved_frame(
    flow: LinearFlow, frame: Frame, W: Array, apart: Array, scale: Array
) -> tuple[Array, Array] | None:
    """Return a new frame, and radii in it, of all Φ(1)Qw + r with |w| <= W and |r| <= `apart`.

    Args:
        flow: Φ.
        frame: Q.
        W: Shape (n,).
        apart: Shape (n,).
        scale: The size of each state, shape (n,).
    """
    matrix, radius = moved_frames(flow, frame, W, apart, scale)
    return (matrix, radius) if np.isfinite(radius).all() else None


def moved_frames(
    flow: LinearFlow, frame: Frame, W: Array, apart: Array, scale: Array
) -> tuple[Array, Array]:
    """Return what `moved_frame` does, for many motions at once.

    All arrays may have a further axis in front. A radius that is not finite is no bound.
    """
    Phi, Phi_error = flow.forward_at_end
    Q_size, W = np.abs(frame.matrix), W[..., np.newaxis]
    moved = Phi @ frame.matrix
    moved_error = error_of_products(np.abs(Phi) @ Q_size) + rounded_up(Phi_error @ Q_size)
    new = frames_of(_frame(moved * np.swapaxes(W, -2, -1), scale))
    turned = np.abs(new.inverse @ moved) + error_of_products(np.abs(new.inverse) @ np.abs(moved))
    turned = rounded_up(turned + new.error @ np.abs(moved))
    beside = rounded_up(moved_error @ W + apart[..., np.newaxis])
    radius: Array = rounded_up(turned @ W + new.inverse_size @ beside)[..., 0]
    return new.matrix, radius


def _value(p: Coefficients, h: float) -> tuple[list[Any], Array]:
    """Return exact numbers near p(h), and bounds on the differences."""
    from flint import arb

    centre, rounding = [], np.zeros(len(p))
    for i, row in enumerate(p):
        value = arb(0)
        for coefficient in reversed(row):
            value = value * h + coefficient
        centre.append(value.mid())
        rounding[i] = magnitude_of(value - centre[-1])
    return centre, rounding


def _frame(edges: Array, scale: Array) -> Array:
    """Return a frame: orthonormal in scaled states, its first axis along the longest edge."""
    scaled = edges / scale[..., np.newaxis]
    scaled = np.where(np.isfinite(scaled), scaled, 0.0)
    lengths = np.linalg.norm(scaled, axis=-2)
    order = np.argsort(-lengths, axis=-1, kind="stable")[..., np.newaxis, :]
    unit = scaled / np.maximum(lengths, 1e-300)[..., np.newaxis, :]
    ordered = np.take_along_axis(unit, order, axis=-1)
    orthonormal, _ = np.linalg.qr(ordered)
    framed: Array = scale[..., np.newaxis] * orthonormal
    return framed
