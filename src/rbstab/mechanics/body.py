"""The rigid body: mass, inertia, contact point, and quantities derived from them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.mechanics.algebra import (
    IDENTITY,
    ZERO_MATRIX,
    cross_matrix,
    inverse,
    quadratic_form,
)
from rbstab.mechanics.numbers import Array, Number, square


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body with a contact point C.

    Args:
        mass: m, kg.
        inertia: J, shape (3, 3), kg m², about the centre of gravity, body coordinates.
        contact_point: R, shape (3,), m, from the centre of gravity to C, body coordinates.

    Source: section 2 and Table 1 of the paper.
    """

    mass: Number
    inertia: Array
    contact_point: Array

    @cached_property
    def contact_cross(self) -> Array:
        """Ř, the cross-product matrix of R, shape (3, 3), m."""
        return cross_matrix(self.contact_point)

    @cached_property
    def inertia_inverse(self) -> Array:
        """J⁻¹, shape (3, 3), 1/(kg m²)."""
        return inverse(self.inertia)

    @cached_property
    def inertia_about_contact(self) -> Array:
        """J - m Ř², the inertia about C (eq. 21), shape (3, 3), kg m², body coordinates."""
        return self.inertia - self.mass * (self.contact_cross @ self.contact_cross)

    @cached_property
    def inertia_about_contact_inverse(self) -> Array:
        """(J - m Ř²)⁻¹, shape (3, 3), 1/(kg m²)."""
        return inverse(self.inertia_about_contact)

    @cached_property
    def mass_matrix_inverse(self) -> Array:
        """𝒥⁻¹ of eq. 3, the block diagonal of I, J⁻¹, I and I/m, shape (12, 12)."""
        blocks = (IDENTITY, self.inertia_inverse, IDENTITY, IDENTITY / self.mass)
        rows = [
            np.hstack([block if column == row else ZERO_MATRIX for column in range(4)])
            for row, block in enumerate(blocks)
        ]
        return np.vstack(rows)

    def gyroscopic_couple(self, Omega: Array) -> Array:
        """Return f(Ω) = -Ω × JΩ, N m, body coordinates (Euler's equations; not stated in eq. 1).

        It is written in the products Ωᵢ Ωⱼ. Where J is diagonal, these are three instead of six.
        """
        (J11, J12, _), (_, J22, J23), (J31, _, J33) = self.inertia
        x, y, z = Omega
        xy, yz, zx = x * y, y * z, z * x
        xx, yy, zz = square(x), square(y), square(z)
        return np.array(
            [
                (J22 - J33) * yz + J23 * (zz - yy) + J12 * zx - J31 * xy,
                (J33 - J11) * zx + J31 * (xx - zz) + J23 * xy - J12 * yz,
                (J11 - J22) * xy + J12 * (yy - xx) + J31 * yz - J23 * zx,
            ]
        )

    def kinetic_energy(self, Omega: Array, V: Array) -> Number:
        """Return the kinetic energy ½ m V'V + ½ Ω'JΩ of eq. 25, in joules."""
        return 0.5 * self.mass * (V @ V) + 0.5 * quadratic_form(self.inertia, Omega)


def triangle_violation(inertia: Array) -> tuple[float, float, float] | None:
    """Return the principal moments if they violate the triangle inequality, else None.

    The principal moments of every real body satisfy j1 <= j2 + j3, in any order of the three.
    Equality (a flat body) is allowed, to round-off.

    Args:
        inertia: J, shape (3, 3), symmetric, kg m².

    Returns:
        The principal moments in descending order, or None.
    """
    small, middle, large = np.linalg.eigvalsh(inertia).tolist()
    if large > (small + middle) * (1 + 1e-12):
        return large, middle, small
    return None
