"""A rest state at the end of θ2 is not hidden by a zero beyond it, where cos θ2 >= 0 is wrong."""

import numpy as np

from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import variable
from rbstab.proof.model import COSINE
from rbstab.proof.search import Search

X, Y, Z = variable(0), variable(1), variable(2)
END = np.nextafter(np.pi / 2, 4)


def test_a_zero_on_the_end_of_the_pitch_stays_undecided() -> None:
    U = -15 * X.cos() * Y.cos() - 25 * X.cos() * Z.cos() - 20 * Y.cos() * Z.cos()
    U = U + 25 * X.sin() * Y.sin() * Z.sin()
    corner = np.array([-END, -END, -END])  # ∇U is zero at θ1 = θ2 = θ3 = -π/2
    low = corner - np.array([0.3, 0.0, 0.3])
    found = Search(BoundedEnergy(U, least={COSINE: 0.0}), Box(low, corner + 0.2)).run(5000)
    assert not found.proved
    assert found.undecided.touch(Box(corner - 1e-9, corner + 1e-9)).any()
