"""Find the members that start in the region where convergence is proved."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.gravity import Gravity
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.experiment.proof import ROUND_OFF
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.switching_record import smooth_rest_system
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Column
from rbstab.sweep.plan.plan import Plan
from rbstab.systems.system import System

CONVERGENCE = ("unknown", "not proved", "proved")
"""The values of the column `convergence`, in the order of their codes."""

NO_PROOF, NOT_PROVED, PROVED = range(3)

COLUMN = Column((), "i1", "1", "convergence to the lowest rest state, by a kept proof", CONVERGENCE)
"""The column `convergence` of a sweep."""


class EnergyBound(NamedTuple):
    """The energy below which members of a variant converge to the lowest rest state, proved.

    Attributes:
        energy: The sum of all energies at the start, J.
        nearest_energy: The energy of the rest state nearest to the unloaded position, J.
        load_energy: b² of `_load_energy`, J.
    """

    energy: float
    nearest_energy: float
    load_energy: float

    def level(self, energy_at_rest: Array | None) -> Array | float:
        """Return the value of v(0), J, below which convergence is proved.

        Args:
            energy_at_rest: As for `ProvedConvergence.of`.
        """
        return self.energy - (self.nearest_energy if energy_at_rest is None else energy_at_rest)


class ProvedConvergence:
    """The proved convergence of members, from cached proofs.

    Members of a variant share a proof if the plan varies only their initial state. Members of
    other variants are "unknown".

    Args:
        plan: The plan.
        results: The folder of results, which contains the cached proofs.
    """

    def __init__(self, plan: Plan, results: Path) -> None:
        self.plan = plan
        bounds = {variant: self._bound(variant, results) for variant in plan.variants}
        self.bounds = {variant: bound for variant, bound in bounds.items() if bound is not None}

    def of(
        self, start: int, stop: int, lyapunov_start: Array, energy_at_rest: Array | None
    ) -> Array:
        """Return the code of each member in `CONVERGENCE`, shape (stop - start,).

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
            lyapunov_start: v(0) of each member, shape (stop - start,), J.
            energy_at_rest: The energy of the rest state at which its v is zero, shape
                (stop - start,), J. None for a sweep without this column: then v of all members
                counts from the rest state nearest to the unloaded position.
        """
        variants = self.plan.values(start, stop).get("controller.variant")
        found = np.full(stop - start, NO_PROOF, dtype=np.int8)
        for variant, bound in self.bounds.items():
            level = bound.level(energy_at_rest)
            rest = bound.energy - level
            error = ROUND_OFF * (np.abs(lyapunov_start) + np.abs(rest) + bound.load_energy)
            inside = lyapunov_start + error < level
            chosen = np.ones(len(found), bool) if variants is None else variants == variant
            found[chosen] = np.where(inside, PROVED, NOT_PROVED)[chosen]
        return found

    def _bound(self, variant: str, results: Path) -> EnergyBound | None:
        """Return the bound of a variant; None without a proof."""
        if any(varied.path[0] != "initial" for varied in self.plan.varied_keys_of(variant)):
            return None
        proof = cached_proof(results, self.plan.base_of(variant))
        if proof is None or proof.region is None:
            return None
        system = smooth_rest_system(self.plan.initial_value_problems[variant])
        return EnergyBound(
            proof.region.lower_bound + proof.states[0].energy,
            nearest_rest_state(system).energy,
            _load_energy(system),
        )


def _load_energy(system: System) -> float:
    """Return b² = 2 G'K_t⁻¹G, J, for the size of the energies that are added up in E = v + U*.

    The energy of the stabilizer is ½ X'K_t X <= P, the sum of all energies that are not negative.
    So |G'X| <= b √P, and E = P - G'X. Then P <= 2|E| + b², and P + |G'X| <= 3|E| + 2b². So the
    round-off of v, at most `SUM_ERROR` times that, is far below `ROUND_OFF` (|E| + b²).
    """
    (weight,) = (one.weight for one in system.elements if isinstance(one, Gravity))
    (stiffness,) = (one.K_t for one in system.elements if isinstance(one, TranslationalStabilizer))
    return float(2.0 * weight @ np.linalg.solve(stiffness, weight)) if weight.any() else 0.0
