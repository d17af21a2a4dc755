"""The energy of a ligament as a function G(s) of the square of its length, with proved bounds.

With y = ℓ/ℓ₀, ε = y - 1 and s = ℓ², let t be ε cut off below 0 and above 2 ε_t, and d what ε is
more than 2 ε_t, or 0. The law of `elements/ligament.py` is then

    G = ℓ₀ k (t³/(12 ε_t) + ε_t d + ½ d²)        G′ = k (t²/(4 ε_t) + d)/(2 ℓ₀ y)
    G″ = k t (2 + t)/(16 ε_t ℓ₀³ y³)
    G‴ = k (3 - y²)/(32 ε_t ℓ₀⁵ y⁵) in the toe, -3 k (1 + ε_t)/(8 ℓ₀⁵ y⁵) beyond it, 0 if slack

All terms of G, G′ and G″ are positive. G and G′ grow with y. G″ grows up
to y = √3 or to the end of the toe, whichever comes first, and falls from there on. G″ is Lipschitz:
Taylor's theorem holds with G‴ on both sides of each of its jumps.
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from rbstab.analysis.proof.lines.intervals import Intervals, between
from rbstab.analysis.proof.polynomial import Ring, exact_number, fraction
from rbstab.elements.ligament import Ligament
from rbstab.mechanics.numbers import Array

NAMES = ("stiffness", "slack_length", "toe_strain")

MARGIN = 1e-14
"""More than the relative error of a bound: it has fewer than twenty roundings, those of k, ℓ₀ and
ε_t among them, each of at most 2⁻⁵³ and to a power of at most five."""


@dataclass(frozen=True)
class LigamentEnergy:
    """G(s), J, of a ligament; each number is exact and rounded once.

    Args:
        stiffness: k, N.
        slack_length: ℓ₀, m.
        toe_strain: ε_t.
    """

    stiffness: float
    slack_length: float
    toe_strain: float

    def at(self, square: Array) -> list[Array]:
        """Return G, G′ and G″ at points, to round-off."""
        y = np.sqrt(square) / self.slack_length
        return [part(y) for part in (self._energy, self._first, self._second)]

    def bounds(self, square: Intervals, order: int) -> list[Intervals]:
        """Return proved bounds on G and its derivatives up to `order` (at most 3)."""
        low, high = self._ratios(square)
        found = [
            _between(part(low), part(high)) for part in (self._energy, self._first)[: order + 1]
        ]
        if order > 1:
            found.append(self._second_between(low, high))
        if order > 2:
            found.append(self._third_between(low, high))
        return found

    def tension(self, square: Intervals) -> Intervals:
        """Return proved bounds on the tension T = 2ℓG′, N: it never falls with the length."""
        low, high = self._ratios(square)
        return _between(*(2.0 * self.slack_length * y * self._first(y) for y in (low, high)))

    def excess(self, square: Intervals) -> Intervals:
        """Return proved bounds on T′ - T/ℓ = 4sG″, N/m.

        It is k t (2 + t)/(4 ε_t ℓ₀ y): 0 if slack, then it grows up to the end of the toe, and
        falls beyond it.
        """
        low, high = self._ratios(square)
        peak = np.clip(1.0 + 2.0 * self.toe_strain, low, high)
        found = np.stack(
            [4.0 * (self.slack_length * y) ** 2 * self._second(y) for y in (low, peak, high)]
        )
        # Of no use where there is no upper bound on the length: there it is at most k/ℓ₀.
        found = np.where(np.isfinite(found), found, 0.0)
        # At the end of a small toe t = y - 1 loses digits, and the largest value could be missed.
        border = 1.0 + 2.0 * self.toe_strain
        closed = self.stiffness * (1.0 + self.toe_strain) / (self.slack_length * border)
        top = np.where(self._has_border(low, high), closed, 0.0)
        return _between(found.min(axis=0), np.maximum(found.max(axis=0), top))

    def _has_border(self, low: Array, high: Array) -> Array:
        """Return whether the end of the toe may lie between bounds on y."""
        border = 1.0 + 2.0 * self.toe_strain
        found: Array = (low <= border * (1 + MARGIN)) & (high >= border * (1 - MARGIN))
        return found

    def _ratios(self, square: Intervals) -> tuple[Array, Array]:
        """Return bounds on y."""
        least, most = np.maximum(square.low, 0.0), np.maximum(square.high, 0.0)
        low = np.sqrt(least) / self.slack_length * (1 - MARGIN)
        high = np.sqrt(most) / self.slack_length * (1 + MARGIN)
        return (
            np.where(np.isnan(square.low), 0.0, low),
            np.where(np.isnan(square.high), np.inf, high),
        )

    def _parts(self, y: Array) -> tuple[Array, Array]:
        """Return t and d."""
        end = 2.0 * self.toe_strain
        return np.clip(y - 1.0, 0.0, end), np.maximum(y - 1.0 - end, 0.0)

    def _energy(self, y: Array) -> Array:
        t, d = self._parts(y)
        shape = t * t * t / (12.0 * self.toe_strain) + self.toe_strain * d + 0.5 * d * d
        found: Array = self.slack_length * self.stiffness * shape
        return found

    def _first(self, y: Array) -> Array:
        t, d = self._parts(y)
        shape = t * t / (4.0 * self.toe_strain) + d
        found: Array = self.stiffness * shape / (2.0 * self.slack_length * np.maximum(y, 0.5))
        return found

    def _second(self, y: Array) -> Array:
        t, _ = self._parts(y)
        factor = self.stiffness / (16.0 * self.toe_strain * self.slack_length**3)
        found: Array = factor * t * (2.0 + t) / np.maximum(y, 0.5) ** 3
        return found

    def _second_between(self, low: Array, high: Array) -> Intervals:
        peak = min(np.sqrt(3.0), 1.0 + 2.0 * self.toe_strain)
        ends = np.stack([self._second(low), self._second(high)])
        top = self._second(np.clip(peak, low, high))
        # As in `excess`.
        border = 1.0 + 2.0 * self.toe_strain
        closed = (
            self.stiffness * (1.0 + self.toe_strain) / (4.0 * (self.slack_length * border) ** 3)
        )
        top = np.fmax(top, np.where(self._has_border(low, high), closed, 0.0))
        return _between(ends.min(axis=0), np.fmax(ends.max(axis=0), top))

    def _third_between(self, low: Array, high: Array) -> Intervals:
        k, end = self.stiffness, self.toe_strain
        fifth = self.slack_length**5
        border = 1.0 + 2.0 * end
        slack = np.where(low <= 1.0, 0.0, np.nan)
        # In the toe: the numerator falls with y.
        first, last = np.clip(low, 1.0, border), np.clip(high, 1.0, border)
        in_toe = (low <= border * (1 + MARGIN)) & (high >= 1.0 - MARGIN)
        factor = k / (32.0 * end * fifth)
        at_first, at_last = (factor * (3.0 - y * y) for y in (first, last))
        toe_most = at_first / np.where(at_first > 0, first, last) ** 5
        toe_least = at_last / np.where(at_last > 0, last, first) ** 5
        # Beyond the toe it is negative, and grows.
        beyond = high >= border * (1 - MARGIN)
        steep = -3.0 * k * (1.0 + end) / (8.0 * fifth)
        steepest, flattest = (steep / np.fmax(one, border) ** 5 for one in (low, high))
        least = [slack, _where(in_toe, toe_least), _where(beyond, steepest)]
        most = [slack, _where(in_toe, toe_most), _where(beyond, flattest)]
        # 3 - y² may cancel: its error is relative to 3 + y².
        error = MARGIN * factor * (3.0 + last * last)
        return between(
            np.fmin.reduce(least) - error - MARGIN * np.abs(np.fmin.reduce(least)),
            np.fmax.reduce(most) + error + MARGIN * np.abs(np.fmax.reduce(most)),
        )


def _where(chosen: Array, values: Array) -> Array:
    return np.where(chosen, values, np.nan)


def _between(low: Array, high: Array) -> Intervals:
    return between(low * (1 - MARGIN), high * (1 + MARGIN))


def ligament_energy(ligament: Ligament) -> LigamentEnergy:
    """Return the energy that a ligament states, whose parameters are exact numbers.

    Raises:
        ValueError: It states another energy than that of this module.
    """
    k, length, end = (exact_number(getattr(ligament, name)) for name in NAMES)
    toe = _coefficients(ligament, (1, 0))
    if toe != [0, 0, 0, length * k / (12 * end)] or _coefficients(ligament, (0, 0)):
        raise ValueError("the toe of a ligament has another energy")
    beyond, place = _coefficients(ligament, (1, 1)), 2 * end
    # Equal up to the second derivative at the end of the toe, and of degree 2 beyond it.
    if len(beyond) != 3 or any(_at(beyond, place, n) != _at(toe, place, n) for n in range(3)):
        raise ValueError("beyond its toe a ligament has another energy")
    return LigamentEnergy(float(k), float(length), float(end))


def _coefficients(ligament: Ligament, mode: tuple[int, int]) -> list[Fraction]:
    """Return the energy as a polynomial in ε, lowest power first; [] if it is zero."""
    ring = Ring(0, 1)
    (strain,) = ring.variables()
    gains: dict[str, Any] = {
        name: ring.constant(exact_number(getattr(ligament, name))) for name in NAMES
    }
    energy = replace(ligament, mode=np.array(mode, dtype=float), **gains).energy(strain)
    found = {powers[0]: fraction(value) for powers, value in energy.terms()}
    return [found.get(power, Fraction(0)) for power in range(1 + max(found, default=-1))]


def _at(coefficients: list[Fraction], place: Fraction, order: int) -> Fraction:
    """Return a derivative of a polynomial at a place."""
    for _ in range(order):
        coefficients = [n * one for n, one in enumerate(coefficients)][1:]
    return sum((one * place**n for n, one in enumerate(coefficients)), start=Fraction(0))
