"""What is proved of all starts within tolerances: data, a sentence, and its file."""

import math
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

from pydantic import NonNegativeFloat, NonNegativeInt, PositiveInt

from rbstab.config.load import initial_sections
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.answers.rounded import LEVEL_DIGITS, rounded_down, rounded_up
from rbstab.experiment.convergence.convergence import EVERY_START, PROVED
from rbstab.experiment.robust.record import WithinRecord, bounds_of
from rbstab.experiment.stored_proof.identity import digest_of, equations_of, proof_id
from rbstab.proof.entries import Entry, Numbers

MAX_PARTS = 64
"""The most parts into which the starts are divided: a limit that is the same on every machine."""

VERSION = 1
"""To be increased when a change of the method changes its results. Older files are not used."""


class ProvedPart(Entry):
    """A part of the starts of which every motion converges, proved.

    Number i of the tolerances is its middle plus its radius times z_i, with low <= z_i <= high.
    From `time` on, s (rounded up), all motions of the part are in the region of a rest state; v at
    that time, J, is in `energy`, below `bound`; None where every start in the range converges.
    """

    low: Numbers
    high: Numbers
    rest_state: PositiveInt
    time: NonNegativeFloat
    energy: tuple[float, float]
    bound: float | None
    steps: NonNegativeInt


class StartsProof(WithinRecord):
    """A proof of convergence for all starts within tolerances.

    fraction is the part of the starts of which it is proved, by volume, rounded down: 1 if it is
    proved of all. examined and steps count all parts that were followed.
    """

    PREFIX = "starts-"

    parts: tuple[ProvedPart, ...]
    fraction: NonNegativeFloat
    examined: NonNegativeInt
    steps: NonNegativeInt

    @property
    def proved(self) -> bool | None:
        """Whether every start converges; None if it is not decided."""
        return True if self.fraction == 1.0 else None

    @property
    def rest_states(self) -> tuple[int, ...]:
        """The numbers of the rest states to which motions converge."""
        return tuple(sorted({part.rest_state for part in self.parts}))

    @property
    def sentence(self) -> str:
        """What is proved, in words without a full stop."""
        if not self.proved:
            percent = rounded_down(Decimal(self.fraction) * 100, 4)
            share = f"proved for {percent} % of them; " if self.parts else ""
            return f"convergence is not decided; {share}{self.why}"
        states = " or ".join(map(str, self.rest_states))
        region = "the certified region"
        if self.rest_states != (1,):
            region = f"the region{'s' * (len(self.rest_states) > 1)} of rest state {states}"
        begin = "the start"
        if self.time > 0:
            begin = f"t = {rounded_up(self.time)} s at the latest"
        inside = f"inside {region} from {begin}"
        if self.bound == math.inf:
            inside = EVERY_START
        _, high = self.energy
        # Parts that reach different regions may have a v above the lowest of their levels.
        level = f" < {rounded_down(self.bound)} J" if high < self.bound < math.inf else ""
        effort = f"{len(self.parts)} part{'s' if len(self.parts) > 1 else ''}, {self.steps} steps"
        return (
            f"the motion converges to rest state {states}, {PROVED}; {inside} (v at most "
            f"{rounded_up(high, LEVEL_DIGITS)} J{level}), {effort}, {self.seconds:.1f} s"
        )

    @property
    def time(self) -> float:
        """The time, s, from which all motions of all parts are in a region."""
        return max((part.time for part in self.parts), default=0.0)

    @property
    def energy(self) -> tuple[float, float]:
        """The smallest and the largest v, J, of any part when it is in a region."""
        return min(part.energy[0] for part in self.parts), max(
            part.energy[1] for part in self.parts
        )

    @property
    def bound(self) -> float:
        """The lowest level, J, of the regions that the parts reach; infinite without one."""
        return min(math.inf if part.bound is None else part.bound for part in self.parts)

    def as_data(self) -> dict[str, Any]:
        """Return the entries of its JSON."""
        entries = self.model_dump(mode="json", exclude={"id", "version", "seconds"})
        return {"proved": self.proved, "rest_states": list(self.rest_states), **entries}


def starts_id(config: Config, tolerances: Sequence[Tolerance]) -> str:
    """Return the identity of a proof of all starts within tolerances.

    It is a digest of the body, the gravity, the controller, the initial state, the tolerances, the
    method and the equations.
    """
    sections = initial_sections(config)
    bounds = [tolerance.model_dump() for tolerance in bounds_of(tolerances)]
    equations = equations_of(config)
    return digest_of((VERSION, MAX_PARTS, proof_id(config), *sections, bounds, equations))
