"""The convergence of exact motions of one system: they are enclosed until it is decided."""

from functools import partial

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Convergence, Undecided
from rbstab.experiment.convergence.decisions import LEAST_FALL, PATIENCE, convergence_in
from rbstab.experiment.convergence.enclosed_system import enclosed_system, state_scale
from rbstab.experiment.convergence.region_bounds import region_energies
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.equations import Equations
from rbstab.proof.motion.motion import Followed, followed
from rbstab.proof.motion.motion_set import MotionSet, point_sets

BATCH_SIZE = 256
"""Motions that are enclosed at once. With more, the arrays do not fit into a cache."""


class ManyMotions:
    """Encloses exact motions of the system of one config, from different starts.

    Args:
        config: The config. Its initial state gives only the size of the states.
        proof: The proof of its rest states and of their regions.
    """

    def __init__(self, config: Config, proof: Proof) -> None:
        self.proof = proof
        self.scale = state_scale(problem_of(config))
        self._equations = Equations(partial(enclosed_system, config))

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
            starts = point_sets(values[some], errors[some], self.scale)
            decide = Decisions(self.proof, self._equations)
            found += followed(self._equations, starts, self.scale, decide, max_steps)
        return found


class Decisions:
    """Decides on some motions: a region that they have reached, or that they have come to rest.

    Args:
        proof: The proof of the rest states and of their regions.
        equations: The equations.
    """

    def __init__(self, proof: Proof, equations: Equations) -> None:
        self.proof, self.equations = proof, equations
        self._highest = max((bound for _, bound in region_energies(proof)), default=-np.inf)
        self._lows: dict[int, list[float]] = {}

    def __call__(
        self, states: MotionSet, times: Array, numbers: Array
    ) -> list[Convergence | Undecided | None]:
        """Return what is decided of each set; see `Decide`."""
        lows, highs = self.equations.energy_bounds(states)
        boxes = zip(*states.angle_bounds(), strict=True)
        found: list[Convergence | Undecided | None] = []
        rows = (lows.tolist(), highs.tolist(), boxes, times.tolist(), numbers.tolist())
        for low, high, box, time, number in zip(*rows, strict=True):
            reached = None
            if high < self._highest:
                reached = convergence_in(self.proof, (low, high), box, time)
            found.append(reached or (Undecided.AT_REST if self._rests(number, low) else None))
        return found

    def _rests(self, number: int, low: float) -> bool:
        """Return whether the energy of a motion, at least `low`, has stopped falling.

        A step that could not be proved counts as one without a fall.
        """
        lows = self._lows.setdefault(number, [])
        lows.append(low)
        if len(lows) <= PATIENCE:
            return False
        return lows[-PATIENCE - 1] - low < LEAST_FALL * (lows[0] - low)
