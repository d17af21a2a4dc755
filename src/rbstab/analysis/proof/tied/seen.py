"""The least energy W over z at angles, to round-off: what a search sees, not what is proved."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.ligaments.free import FreeLigaments
from rbstab.analysis.proof.tied.energy import TiedEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

STEPS = 60

CONVERGED = 1e-14
"""A step that is so small, relative to z, is the last one."""


def energies(energy: TiedEnergy, line: int | None, Theta: Array) -> Array:
    """Return the least W over z at angles, or W where a line has no length, shape (m,), J.

    Args:
        energy: W.
        line: The number of a line that has no length, or None.
        Theta: The angles, shape (m, 3), rad.
    """
    z = shifts(energy, Theta) if line is None else -_offsets(energy.lines[line].offset, Theta)
    value = energy.form.value(Theta) + _Convex(energy, Theta).at(z)[0]
    for one in energy.lines:
        length = np.linalg.norm(z + _offsets(one.offset, Theta), axis=1)
        value = value + one.weight * length
    return np.asarray(value)


def shifts(energy: TiedEnergy, Theta: Array) -> Array:
    """Return z at which W is least, at angles of shape (m, 3), rad; shape (m, 3), m.

    Each step is one of Newton's method on all but the lines of springs, whose pull is taken as it
    is. Without ligaments and formulas it is z = -S⁻¹Σ w_j u_j.
    """
    convex = _Convex(energy, Theta)
    r = [_offsets(one.offset, Theta) for one in energy.lines]
    z = np.zeros_like(Theta)
    for _ in range(STEPS):
        _, slope, bend = convex.at(z)
        for one, offset in zip(energy.lines, r, strict=True):
            slope = slope + one.weight * _unit(z + offset)
        step = np.linalg.solve(bend, slope[:, :, np.newaxis])[:, :, 0]
        z = z - step
        if np.abs(step).max() <= CONVERGED * np.abs(z).max():
            break
    return z


class _Convex:
    """The part of W that is convex in z at some angles, shape (m, 3)."""

    def __init__(self, energy: TiedEnergy, Theta: Array) -> None:
        self.energy, self.Theta = energy, Theta
        self.ligaments = FreeLigaments(energy.stiffness, energy.ligaments)
        self.offsets = [_offsets(one.offset, Theta) for one in energy.ligaments]
        self.position = _offsets(energy.position, Theta) if energy.formulas else Theta

    def at(self, z: Array) -> list[Array]:
        """Return it and its derivatives by z of order 1 and 2."""
        found = self.ligaments.terms(self.offsets, z)
        for formula in self.energy.formulas:
            jet = formula.of_shift(self.Theta, self.position + z)
            parts = (jet.rows[0], jets.gradient(jet), jets.hessian(jet))
            found = [one + other for one, other in zip(found, parts, strict=True)]
        return found


def _offsets(forms: Sequence[TrigonometricForm], Theta: Array) -> Array:
    return np.stack([form.value(Theta) for form in forms], axis=1)


def _unit(e: Array) -> Array:
    return e / np.maximum(np.linalg.norm(e, axis=1, keepdims=True), 1e-300)
