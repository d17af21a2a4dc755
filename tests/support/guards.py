"""Energies with guards whose rest states have a closed form."""

import numpy as np

from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.trigonometric import TrigonometricForm


def parabola_with(guard: Guard, centre, weights=(1.0, 1.0, 1.0)):
    """Return U = ½ Σ w_i (θ_i - c_i)² with a guard."""
    weights = np.array(weights)
    constant = np.array([[[0.5 * weights @ np.array(centre) ** 2]]])
    return TrigonometricForm(np.diag(weights), -weights * centre, constant, guard=guard)
