"""The convergence of exact motions of one system: they are enclosed until it is decided."""

from functools import partial

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import Convergence, Undecided
from rbstab.experiment.convergence.decisions import (
    LEAST_FALL,
    PATIENCE,
    convergence_in,
)
from rbstab.experiment.convergence.enclosed_system import enclosed_system, state_scale
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import region_bounds
from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.equations import Equations
from rbstab.proof.motion.motion import MAX_STEPS, Followed, followed
from rbstab.proof.motion.motion_set import MotionSet, point_sets

BATCH_SIZE = 256
"""Motions that are enclosed at once. With more, the arrays do not fit into a cache."""


class Motions:
    """Encloses exact motions of the system of one config, from different starts.

    Args:
        config: The config. Its initial state gives only the size of the states.
        proof: The proof of its rest states and of their regions.
    """

    def __init__(self, config: Config, proof: Proof) -> None:
        self.proof, self.scale = proof, state_scale(problem_of(config))
        self.equations = Equations(partial(enclosed_system, config))

    def follow(
        self, starts: MotionSet, max_steps: int = MAX_STEPS, *, rests: bool = True
    ) -> list[Followed]:
        """Follow the motions of some sets of starts until their convergence is proved.

        What is found of a set does not depend on the others.

        Args:
            starts: The sets.
            max_steps: The most steps of each.
            rests: Whether a set is given up that has come to rest.

        Returns:
            What came of each set. Its decision is its `Convergence`, `Undecided.AT_REST`, or None.
        """
        decide = Decisions(self.proof, self.equations, rests=rests)
        return followed(self.equations, starts, self.scale, decide, max_steps)

    def follow_all(self, values: Array, errors: Array, max_steps: int) -> list[Followed]:
        """Follow the motions from some starts, as `follow` does, some at a time.

        Args:
            values: The initial states of `enclosed_system`, shape (motions, n).
            errors: Bounds on their distances from the exact ones, in the same shape.
            max_steps: The most steps of a motion.
        """
        motions: list[Followed] = []
        for first in range(0, len(values), BATCH_SIZE):
            some = slice(first, first + BATCH_SIZE)
            motions += self.follow(point_sets(values[some], errors[some], self.scale), max_steps)
        return motions


class Decisions:
    """Decides on some motions: a region that they have reached, or that they have come to rest.

    Args:
        proof: The proof of the rest states and of their regions.
        equations: The equations.
        rests: Whether to decide that a motion has come to rest.
        last: The time up to which motions are followed in any case, s.

    Attributes:
        convergences: What is decided of motions so far, by their numbers; one with an entry is only
            followed to `last`.
    """

    def __init__(
        self, proof: Proof, equations: Equations, *, rests: bool = True, last: float = 0.0
    ) -> None:
        self.proof, self.equations, self.rests, self.last = proof, equations, rests, last
        self.convergences: dict[int, Convergence] = {}
        self._highest = max(region_bounds(proof), default=-np.inf)
        self._lows: dict[int, list[float]] = {}

    def __call__(
        self, states: MotionSet, times: Array, numbers: Array
    ) -> list[Convergence | Undecided | None]:
        """Return what is decided of each set (a `Decide`).

        Args:
            states: The sets.
            times: Their times, shape (sets,), s.
            numbers: Their places among all starts, shape (sets,).
        """
        lows, highs = self.equations.energy_bounds(states)
        boxes = zip(*states.angle_bounds(), strict=True)
        rows = (lows.tolist(), highs.tolist(), boxes, times.tolist(), numbers.tolist())
        return [self._decision(*row) for row in zip(*rows, strict=True)]

    def _decision(
        self, low: float, high: float, box: tuple[Array, Array], time: float, number: int
    ) -> Convergence | Undecided | None:
        convergence = self.convergences.get(number)
        if convergence is None and high < self._highest:
            convergence = convergence_in(self.proof, (low, high), box, time)
        if convergence is None:
            return Undecided.AT_REST if self.rests and self._rests(number, low) else None
        self.convergences[number] = convergence
        return convergence if time >= self.last else None

    def _rests(self, number: int, low: float) -> bool:
        """Return whether the energy of a motion, at least `low`, has stopped falling."""
        lows = self._lows.setdefault(number, [])
        # A step that could not be proved counts as one without a fall.
        lows.append(low)
        if len(lows) <= PATIENCE:
            return False
        return lows[-PATIENCE - 1] - low < LEAST_FALL * (lows[0] - low)
