"""Whether an element may switch just at a rest state of a proof."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import without_code
from rbstab.elements.element import NO_STATE
from rbstab.experiment.stored_proof.data import ProofData
from rbstab.mechanics.numbers import Array
from rbstab.proof.entries import ProvedState

if TYPE_CHECKING:
    from rbstab.proof.enclosures.intervals import Intervals
    from rbstab.proof.exact.expr import Expr

WEIGHT = 2000
"""The number of a variable t, which is zero: ∂/∂t of the least U + t h is h at the lowest point."""


def may_switch(
    proof: ProofData, state: ProvedState, config: Config, name: str, first: int | None = None
) -> bool:
    """Return whether an event function h of an element may be zero at a proved rest state.

    It is bounded over the enclosure of Θ. If h depends on the position too, it is taken where U is
    least: with V(Θ, t) = min (U + t h), ∂V/∂t = h there.

    Args:
        proof: The proof.
        state: The rest state; what is returned holds for all of its enclosure.
        config: The config of the proof.
        name: The name of an element that is no code of a user.
        first: How many of its first event functions count; None: all.
    """
    from rbstab.proof.exact.expr import numbers, variable

    plain = without_code(config)
    coordinates = smooth_rest_system(problem_of(plain)).coordinates
    exact = configurations(replace(system_of(plain, numbers), coordinates=coordinates))
    motion = exact.motion(np.array([variable(k) for k in range(exact.size)], dtype=object))
    (element,) = (candidate for candidate in exact.system.elements if candidate.name == name)
    box = np.array(state.enclosure)[:, :, None]
    with np.errstate(all="ignore"):
        events = element.guards(motion, NO_STATE)[:first]
        intervals = [_over(proof, box, plain, event) for event in events]
    return any(
        interval is None or bool(interval.lo[0] <= 0 <= interval.hi[0]) for interval in intervals
    )


def _over(proof: ProofData, box: Array, plain: Config, event: "Expr") -> "Intervals | None":
    """Return bounds on an event function at the lowest point, over a box of Θ; None if unknown."""
    from rbstab.proof.enclosures.bounds import BoundedEnergy
    from rbstab.proof.enclosures.levels import range_of
    from rbstab.proof.enclosures.tied import bounds_of
    from rbstab.proof.exact.atoms import VAR
    from rbstab.proof.exact.expr import atom, variable
    from rbstab.proof.exact.rewriting import substituted
    from rbstab.proof.model import energy_of

    low, high = box
    if event.variables <= {0, 1, 2}:
        return range_of(BoundedEnergy(event).over(low, high))
    energy = energy_of(smooth_rest_system(problem_of(plain)), lambda kind: system_of(plain, kind))
    stored = proof.reduced_energy
    if stored is None or stored.energy.U != energy.U:
        return None  # elements of users move the lowest point
    if not np.isfinite(bounds_of(energy).over(low, high).slopes.mag).all():
        return None  # with springs, z may not be the only stationary point
    places = {
        atom(VAR, k): energy.minimiser[k]
        if k in energy.minimiser
        else variable(k) + energy.shift.get(k, 0)
        for k in event.variables - {0, 1, 2}
    }
    U = energy.U + variable(WEIGHT) * substituted(event, places)
    V = BoundedEnergy(U, (0, 1, 2, WEIGHT), energy.free, energy.least)
    nothing = np.zeros((1, 1))
    return V.over(np.vstack([low, nothing]), np.vstack([high, nothing])).slopes[-1]
