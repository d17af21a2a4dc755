"""The convergence of many exact motions of one system: they are enclosed together, in doubles."""

from functools import partial

import numpy as np

from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.rounding import rounded_up
from rbstab.analysis.motion_proof.sets.equations import Equations, equations_of
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_motion import Followed, followed
from rbstab.analysis.motion_proof.sets.set_step import FOR_POINTS
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Convergence, Undecided
from rbstab.experiment.convergence.decisions import LEAST_FALL, PATIENCE, convergence_in
from rbstab.experiment.convergence.enclosed_system import enclosed_system, state_scale
from rbstab.experiment.convergence.region_bounds import region_energies
from rbstab.experiment.stored_proof.proof import Proof
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
            What came of each motion. Its decision is its `Convergence`, `Undecided.AT_REST`, or
            None.
        """
        found: list[Followed] = []
        for first in range(0, len(values), BATCH_SIZE):
            some = slice(first, first + BATCH_SIZE)
            starts = self._starts(values[some], errors[some])
            decide = _Decisions(self.proof, self._equations, len(starts))
            found += followed(self._equations, starts, self.scale, decide, max_steps, FOR_POINTS)
        return found

    def _starts(self, values: Array, errors: Array) -> MotionSet:
        frame = np.broadcast_to(np.diag(self.scale), (len(values), *2 * (len(self.scale),)))
        return MotionSet(POINT, values[..., np.newaxis], frame, rounded_up(errors / self.scale))


class _Decisions:
    """Decides on some motions: a region that they have reached, or that they have come to rest.

    Args:
        proof: The proof of the rest states and of their regions.
        equations: The equations.
        count: The number of motions.
    """

    def __init__(self, proof: Proof, equations: Equations, count: int) -> None:
        self.proof, self.energy = proof, equations.energy
        self._highest = max((bound for _, bound in region_energies(proof)), default=-np.inf)
        self._lows: list[Array] = []
        self._count = count

    def __call__(
        self, states: MotionSet, times: Array, numbers: Array
    ) -> list[Convergence | Undecided | None]:
        """Return what is decided of each set; see `Decide`."""
        lows, highs = states.bounds(self.energy)
        low_corners, high_corners = states.angle_bounds()
        found: list[Convergence | Undecided | None] = [None] * len(states)
        for k in np.flatnonzero(self._at_rest(lows, numbers)).tolist():
            found[k] = Undecided.AT_REST
        for k in np.flatnonzero(highs < self._highest).tolist():
            energy, box = (float(lows[k]), float(highs[k])), (low_corners[k], high_corners[k])
            found[k] = convergence_in(self.proof, energy, box, float(times[k])) or found[k]
        return found

    def _at_rest(self, lows: Array, numbers: Array) -> Array:
        """Return whether the energy of each motion has stopped falling.

        A step that could not be proved counts as one without a fall.
        """
        row = np.full(self._count, np.nan)
        row[numbers] = lows
        self._lows.append(row)
        if len(self._lows) <= PATIENCE:
            return np.zeros(len(numbers), dtype=bool)
        first, before = self._lows[0][numbers], self._lows[-PATIENCE - 1][numbers]
        return np.asarray(before - lows < LEAST_FALL * (first - lows))
