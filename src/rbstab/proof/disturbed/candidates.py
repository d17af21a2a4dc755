"""The numbers of a claim that is worth a proof: the best ones at some samples of Θ.

Nothing here is a proof. At samples of Θ, and for given ε and α, the largest loads follow from
eigenvalues. With a factor t on n loads and β_i = αℓ/n(t w̄_i)², the matrix of the proof is definite
if t² Σ n w̄_i² H_i'H_i < αℓQ, where Q is that of -(V' + αV) over (1, x, u), and H_i its rows of w_i.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import angles
from rbstab.proof.disturbed.forms import Forms
from rbstab.proof.disturbed.invariant import Claim
from rbstab.proof.disturbed.matrices import Matrices

SAMPLES = 1500
"""Of Θ in S, and so many on its border."""

CROSS, RATES = np.geomspace(0.03, 0.9, 8), np.geomspace(0.3, 2.0, 6)
"""Tried first: ε as a share of the largest with V > 0, and α as a multiple of ε."""

STEPS = 120
"""Of the search for better numbers."""

OF_LEVEL, OF_WEIGHT = 0.8, 0.6
"""Loads that are a share q of the largest leave a margin of q²; these powers of it go to ℓ and to
Σ βw̄²/αℓ."""

LEAST_USED = 0.85
"""For smaller loads the margins grow no more: a higher ℓ holds for more starts."""

DIGITS = 5
"""Significant digits of the numbers of a claim."""


@dataclass(frozen=True)
class Candidate:
    """The best numbers at the samples.

    Args:
        factor: The largest factor t on the loads; 0 if there is none.
        cross: ε, 1/s.
        rate: α, 1/s.
        level: The least V on the border, J.
    """

    factor: float
    cross: float = 0.0
    rate: float = 0.0
    level: float = 0.0

    def claim(self, tilt: Fraction, sizes: Sequence[Fraction], used: float) -> Claim:
        """Return a claim that leaves a margin to each condition.

        Args:
            tilt: ρ, rad.
            sizes: w̄ of each load.
            used: These as a share of the largest, below 1.
        """
        used = max(used, LEAST_USED)
        level = self.level * used**OF_LEVEL
        each = self.rate * level * used**OF_WEIGHT / len(sizes)
        weights = tuple(_short(each / float(w) ** 2) for w in sizes)
        numbers = map(_short, (self.cross, self.rate, level))
        return Claim(tilt, tuple(sizes), weights, *numbers)


def _short(x: float) -> Fraction:
    return Fraction(f"{x:.{DIGITS}g}")


class Samples:
    """V and V' at samples of Θ, the last of them on the border.

    Args:
        forms: V and V'.
        tilt: ρ, rad.
        sizes: w̄ of each load, N m or N.
    """

    def __init__(self, forms: Forms, tilt: float, sizes: Sequence[float]) -> None:
        rng = np.random.default_rng(0)
        axes = rng.normal(size=(3, 2 * SAMPLES))
        axes /= np.linalg.norm(axes, axis=0)
        half = 0.5 * tilt * np.append(rng.random(SAMPLES) ** (1 / 3), np.ones(SAMPLES))
        Theta, _ = angles(np.cos(half), np.sin(half) * axes)
        self.sizes, self.still = np.array(sizes), slice(0, forms.still)
        self._matrices = Matrices([*forms.values, *forms.rates])
        self._at = self._matrices.at(Theta)

    def add(self, Theta: Sequence[float]) -> None:
        """Add a sample that is not on the border."""
        new = self._matrices.at(np.array(Theta)[:, None])
        self._at = [np.append(a, b, axis=2) for a, b in zip(new, self._at, strict=True)]

    def candidate(self) -> Candidate:
        """Return the numbers with which the largest loads are allowed."""
        # Imported late: it takes a while.
        from scipy.optimize import minimize

        V0, V1 = (V[self.still, self.still, -SAMPLES:].T for V in self._at[:2])
        try:
            most = 1.0 / np.abs(np.linalg.eigvals(np.linalg.solve(V0, V1))).max()
        except np.linalg.LinAlgError:  # nothing resists a rotation
            return Candidate(0.0)
        starts = np.log(list(product(most * CROSS, RATES))).cumsum(axis=1)
        first = max(starts, key=lambda x: self.best(x).factor)
        optimum = minimize(
            lambda x: -self.best(x).factor,
            first,
            method="Nelder-Mead",
            options={"maxiter": STEPS},
        )
        return self.best(optimum.x)

    def best(self, x: Array) -> Candidate:
        """Return the largest factor for ln ε and ln α."""
        cross, rate = np.exp(np.clip(x, -40.0, 40.0)).tolist()
        V0, V1, W0, W1 = (M.T for M in self._at)
        V, W = V0 + cross * V1, W0 + cross * W1
        still, count = self.still, len(self.sizes)
        heights = _least(V[:, still, still])
        level = float(heights[-SAMPLES:].min())
        Q = -(W + rate * V)[heights <= level]
        H = Q[:, still.stop :, still] * np.repeat(self.sizes * np.sqrt(count), 3)[:, None]
        Q = Q[:, still, still]
        if not level > 0 or not np.all(np.linalg.eigvalsh(Q)[:, 0] > 0):
            return Candidate(0.0)
        needed = np.linalg.eigvalsh(H @ np.linalg.solve(Q, np.swapaxes(H, 1, 2)))[:, -1].max()
        return Candidate(float(np.sqrt(rate * level / needed)), cross, rate, level)


def _least(V: Array) -> Array:
    """Return the least z'Vz with z = (1, x, u) of each matrix; -inf where there is none."""
    block, side = V[:, 1:, 1:], V[:, 1:, :1]
    least = V[:, 0, 0] - (side * np.linalg.solve(block, side))[:, :, 0].sum(axis=1)
    return np.where(np.linalg.eigvalsh(block)[:, 0] > 0, least, -np.inf)
