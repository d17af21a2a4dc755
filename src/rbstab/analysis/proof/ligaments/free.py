"""Ligaments of a body that is not held: their least energy over the position, a function of Θ.

With z, the shift of the position from where it would be without the ligaments, it is

    V(Θ) = min over z of ½ z'Sz + Σ G_j(|e_j|²)    e_j = z + r_j(Θ)

S is positive definite. The tension of a ligament never falls with its length, so each term is
convex in z: for each Θ there is one z, and V has two continuous derivatives.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.ligaments.law import LigamentEnergy
from rbstab.analysis.proof.lines.directions import direction, products
from rbstab.analysis.proof.lines.intervals import Intervals, exact, near
from rbstab.analysis.proof.lines.line import LinePart
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import TrigonometricForm

MAX_STEPS = 80
HALVINGS = 30
"""The largest numbers of Newton's steps, and of halvings of one of them."""

CONVERGED = 1e-9
"""A step that is so small, relative to the lengths, is the last one: it reaches round-off."""

MARGIN = 1 + 1e-12
"""A factor that exceeds the rounding errors of a bound."""


@dataclass(frozen=True, eq=False)
class FreeLigament:
    """A ligament with e = z + r(Θ).

    Args:
        offset: The three entries of r, m.
        law: Its energy G.
    """

    offset: "tuple[TrigonometricForm, ...]"
    law: LigamentEnergy

    def offsets(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of r of order 0 to `order` at points: (m, 3), (m, 3, 3), ..."""
        entries = [form.approximate(Theta, order) for form in self.offset]
        return [np.stack(parts, axis=1) for parts in zip(*entries, strict=True)]

    def pull(self, e: Intervals) -> Intervals:
        """Return bounds on p = ∂G/∂e = Tu, with the tension T and u = e/|e|, shape (m, 3), N."""
        return self.law.tension(e.square().sum(1))[:, np.newaxis] * direction(e)

    def bend(self, e: Intervals) -> Intervals:
        """Return bounds on P = ∂²G/∂e² = (T/ℓ)I + (T′ - T/ℓ)uu', shape (m, 3, 3), N/m."""
        squared = e.square().sum(1)
        across = near(2.0) * self.law.bounds(squared, 1)[1]
        excess = self.law.excess(squared)
        unit = exact(np.eye(3))
        along = excess[:, np.newaxis, np.newaxis] * products(direction(e))
        return across[:, np.newaxis, np.newaxis] * unit + along

    @cached_property
    def longest(self) -> float:
        """A bound on |r| at all Θ, m."""
        sizes = [float(form.trigonometric_bound(0)) for form in self.offset]
        return float(np.linalg.norm(sizes)) * MARGIN

    @cached_property
    def turned(self) -> Array:
        """Bounds on |∂r/∂θ_i| at all Θ, shape (3,), m/rad."""
        slopes = np.array([form.trigonometric_bound(1) for form in self.offset])
        return np.linalg.norm(slopes, axis=0) * MARGIN


@dataclass(frozen=True, eq=False)
class FreeLigaments(LinePart):
    """V(Θ), J.

    Args:
        stiffness: S, shape (3, 3), N/m, exact numbers rounded once.
        ligaments: The ligaments.
    """

    stiffness: Array
    ligaments: tuple[FreeLigament, ...]

    @property
    def forms(self) -> "Sequence[TrigonometricForm]":
        """The entries of all r."""
        return [form for ligament in self.ligaments for form in ligament.offset]

    def shift(self, Theta: Array) -> Array:
        """Return z at points, to round-off, shape (m, 3), m: by Newton's method."""
        r = [ligament.offsets(Theta, 0)[0] for ligament in self.ligaments]
        size = 1e-300 + sum(np.abs(one).max(axis=1) for one in r)
        z, left = np.zeros_like(Theta), np.arange(len(Theta))
        energy, slope, bend = self.terms(r, z)
        for _ in range(MAX_STEPS):
            if not len(left):
                break
            step = -np.linalg.solve(bend, slope[:, :, np.newaxis])[:, :, 0]
            short = np.abs(step).max(axis=1) <= CONVERGED * size[left]
            part = [one[left] for one in r]
            found = self.terms(part, z[left] + step)
            for _ in range(HALVINGS):
                worse = (found[0] > energy + 1e-14 * np.abs(energy)) & ~short
                if not worse.any():
                    break
                step[worse] *= 0.5
                found = self.terms(part, z[left] + step)
            z[left] += step
            energy, slope, bend = (one[~short] for one in found)
            left = left[~short]
        return z

    def terms(self, r: Sequence[Array], z: Array) -> list[Array]:
        """Return ½ z'Sz + Σ G_j and its derivatives by z of order 1 and 2."""
        pulled = z @ self.stiffness
        energy, slope = 0.5 * np.einsum("mi,mi->m", z, pulled), pulled
        bend = np.tile(self.stiffness, (len(z), 1, 1))
        for ligament, offset in zip(self.ligaments, r, strict=True):
            e = z + offset
            G = ligament.law.at((e**2).sum(axis=1))
            energy = energy + G[0]
            slope = slope + 2 * G[1][:, np.newaxis] * e
            bend = bend + bend_of(e, G[1], G[2])
        return [energy, slope, bend]

    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off.

        ∂V/∂θ_i = Σ p_j'r_j,i with p_j = 2G_j′e_j. The second ones follow from z,i = -H_zz⁻¹H_zi.
        """
        z = self.shift(Theta)
        r = [ligament.offsets(Theta, order) for ligament in self.ligaments]
        value, _, bend = self.terms([one[0] for one in r], z)
        found = [value]
        slope, second = np.zeros((len(z), 3)), np.zeros((len(z), 3, 3))
        mixed = np.zeros((len(z), 3, 3))
        for ligament, one in zip(self.ligaments, r, strict=True):
            e = z + one[0]
            G = ligament.law.at((e**2).sum(axis=1))
            pull = 2 * G[1][:, np.newaxis] * e
            if order > 0:
                slope += np.einsum("mk,mki->mi", pull, one[1])
            if order > 1:
                P = bend_of(e, G[1], G[2])
                second += np.einsum("mk,mkij->mij", pull, one[2])
                second += np.einsum("mki,mkl,mlj->mij", one[1], P, one[1])
                mixed += np.einsum("mkl,mlj->mkj", P, one[1])
        if order > 0:
            found.append(slope)
        if order > 1:
            found.append(second - np.einsum("mki,mkj->mij", mixed, np.linalg.solve(bend, mixed)))
        return found

    def over(self, t: Array, boxes: Boxes) -> list[Intervals]:
        """Return proved bounds over boxes: see `LinePart.over`. The Hessian is that over a box."""
        # Imported late: those bounds are of this class.
        from rbstab.analysis.proof.ligaments.free_bounds import parts_over

        return parts_over(self, t, boxes)

    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds at points; only those of order 0 are known."""
        from rbstab.analysis.proof.ligaments.free_bounds import value_at

        if order > 0:
            raise NotImplementedError("the slopes of free ligaments are enclosed over boxes")
        return [value_at(self, Theta)]

    @cached_property
    def largest(self) -> float:
        """A bound on V at any point, J: it is at most Σ G_j at z = 0."""
        squares = [exact(np.array([ligament.longest])).square() for ligament in self.ligaments]
        pairs = zip(self.ligaments, squares, strict=True)
        return MARGIN * sum(float(one.law.bounds(s, 0)[0].high[0]) for one, s in pairs)

    @cached_property
    def steepest(self) -> Array:
        """Bounds on |∂V/∂θ_i| at any point, shape (3,), J/rad.

        The tension T of a ligament grows at most with k/ℓ₀, so T² <= 2 (k/ℓ₀) G <= 2 (k/ℓ₀) V.
        """
        found = np.zeros(3)
        for ligament in self.ligaments:
            stiffness = ligament.law.stiffness / ligament.law.slack_length
            found += np.sqrt(2 * stiffness * self.largest) * MARGIN * ligament.turned
        return found * MARGIN

    @cached_property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,); not proved."""
        return 1e-15 * self.largest, 1e-14 * self.steepest


def bend_of(e: Array, first: Array, second: Array) -> Array:
    """Return the Hessian of G(|e|²) by e, 2G′I + 4G″ee', shape (m, 3, 3)."""
    found: Array = 2 * first[:, np.newaxis, np.newaxis] * np.eye(3)
    return found + 4 * np.einsum("m,mi,mj->mij", second, e, e)
