"""Which members start where their convergence is proved."""

from pathlib import Path

import numpy as np

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.experiment.proof import ROUND_OFF
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.switching_record import resting_system
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Column
from rbstab.sweep.plan.plan import Plan

CONVERGENCE = ("unknown", "not proved", "proved")
"""What is known of a member's convergence, in the order of its codes."""

NO_PROOF, NOT_PROVED, PROVED = range(3)

COLUMN = Column((), "i1", "1", "convergence to the lowest rest state, by a kept proof", CONVERGENCE)
"""The column `convergence` of a sweep."""


class ProvedConvergence:
    """What kept proofs say of the members that share them.

    Members share a proof where the plan varies nothing but their start; of others nothing is said.

    Args:
        plan: The plan.
        results: The folder of results, with its proofs.
    """

    def __init__(self, plan: Plan, results: Path) -> None:
        self.plan = plan
        self.bounds = {variant: self._bound(variant, results) for variant in plan.variants}

    def of(self, start: int, stop: int, lyapunov_start: Array) -> Array:
        """The code of each member in `CONVERGENCE`, shape (stop - start,).

        Args:
            start: The first member.
            stop: The one behind the last.
            lyapunov_start: Their v(0), shape (stop - start,), J.
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
        """The level of v below which convergence is proved, J, counted as the members' v is."""
        if any(column.path[0] != "initial" for column in self.plan.columns_of(variant)):
            return None
        base = self.plan.base_of(variant)
        proof = cached_proof(results, base)
        if proof is None or proof.region is None:
            return None
        rest = nearest_rest_state(resting_system(problem_of(base))).energy
        return proof.region.lower_bound - (rest - proof.states[0].energy)
