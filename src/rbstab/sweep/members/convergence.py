"""Find the members that start in the region where convergence is proved."""

from pathlib import Path

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
        self.bounds = {variant: self._bound(variant, results) for variant in plan.variants}

    def of(self, start: int, stop: int, lyapunov_start: Array) -> Array:
        """Return the code of each member in `CONVERGENCE`, shape (stop - start,).

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
            lyapunov_start: v(0) of each member, shape (stop - start,), J.
        """
        variants = self.plan.values(start, stop).get("controller.variant")
        found = np.full(stop - start, NO_PROOF, dtype=np.int8)
        for variant, bound in self.bounds.items():
            if bound is None:
                continue
            inside = lyapunov_start + ROUND_OFF * np.abs(lyapunov_start) < bound
            chosen = np.ones(len(found), bool) if variants is None else variants == variant
            found[chosen] = np.where(inside, PROVED, NOT_PROVED)[chosen]
        return found

    def _bound(self, variant: str, results: Path) -> float | None:
        """Return the level of v, J, below which convergence is proved; None without a proof.

        The level and the v of the members are relative to the energy of the same rest state.
        """
        if any(varied.path[0] != "initial" for varied in self.plan.varied_keys_of(variant)):
            return None
        base = self.plan.base_of(variant)
        proof = cached_proof(results, base)
        if proof is None or proof.region is None:
            return None
        system = smooth_rest_system(self.plan.initial_value_problems[variant])
        rest = nearest_rest_state(system).energy
        error = ROUND_OFF * (abs(rest) + _load_energy(system))
        return proof.region.lower_bound - (rest - proof.states[0].energy) - error


def _load_energy(system: System) -> float:
    """Return b² = 2 G'K_t⁻¹G, J, for the size of the energies that are added up in E = v + U*.

    The energy of the stabilizer is ½ X'K_t X <= P, the sum of all energies that are not negative.
    So |G'X| <= b √P, and E = P - G'X. Then P <= 2|E| + b², and P + |G'X| <= 3|E| + 2b². So the
    round-off of v, at most `SUM_ERROR` times that, is far below `ROUND_OFF` (|E| + b²).
    """
    (weight,) = (one.weight for one in system.elements if isinstance(one, Gravity))
    (stiffness,) = (one.K_t for one in system.elements if isinstance(one, TranslationalStabilizer))
    return float(2.0 * weight @ np.linalg.solve(stiffness, weight)) if weight.any() else 0.0
