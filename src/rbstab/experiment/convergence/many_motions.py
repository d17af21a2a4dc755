"""The convergence of many exact motions of one system: they are enclosed together, in doubles."""

from functools import partial

import numpy as np

from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.rounding import rounded_up
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_motion import Followed, followed
from rbstab.analysis.motion_proof.sets.set_step import FOR_POINTS
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.convergence.decisions import convergence_in
from rbstab.experiment.convergence.enclosed_system import enclosed_system, state_scale
from rbstab.experiment.convergence.region_bounds import region_energies
from rbstab.experiment.proof_record import Proof
from rbstab.mechanics.numbers import Array

BATCH_SIZE = 256
"""Motions that are enclosed at once. With more, the arrays do not fit into a cache."""

POINT = Monomials(0, 0)
"""The monomials of a set with a single start."""


class ManyMotions:
    """Encloses exact motions of the system of one config, from different starts.

    Args:
        config: The config. Its initial state gives only the size of the states.
        proof: The proof of its rest states and of their regions.
    """

    def __init__(self, config: Config, proof: Proof) -> None:
        self.proof = proof
        self.scale = state_scale(problem_of(config))
        self._highest = max((bound for _, bound in region_energies(proof)), default=-np.inf)
        with proof_precision():
            self._equations = equations_of(partial(enclosed_system, config))

    def follow(self, values: Array, errors: Array, max_steps: int) -> list[Followed]:
        """Follow the exact motions from some starts until their convergence is proved.

        What is found of a motion does not depend on the others.

        Args:
            values: The initial states of `enclosed_system`, shape (motions, n).
            errors: Bounds on their distances from the exact ones, in the same shape.
            max_steps: The most steps of a motion.

        Returns:
            What came of each motion. Its decision is its `Convergence`, or None.
        """
        found: list[Followed] = []
        for first in range(0, len(values), BATCH_SIZE):
            some = slice(first, first + BATCH_SIZE)
            starts = self._starts(values[some], errors[some])
            found += followed(
                self._equations, starts, self.scale, self._decide, max_steps, FOR_POINTS
            )
        return found

    def _starts(self, values: Array, errors: Array) -> MotionSet:
        frame = np.broadcast_to(np.diag(self.scale), (len(values), *2 * (len(self.scale),)))
        return MotionSet(POINT, values[..., np.newaxis], frame, rounded_up(errors / self.scale))

    def _decide(self, states: MotionSet, times: Array) -> list[Convergence | None]:
        lows, highs = states.bounds(self._equations.energy)
        low_corners, high_corners = states.angle_bounds()
        found: list[Convergence | None] = [None] * len(states)
        for k in np.flatnonzero(highs < self._highest).tolist():
            energy, box = (float(lows[k]), float(highs[k])), (low_corners[k], high_corners[k])
            found[k] = convergence_in(self.proof, energy, box, float(times[k]))
        return found
