"""What is proved of one start with a soft guard of θ2: theorem 11, with its independent check."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.elements.registry import KINDS
from rbstab.experiment.answers.rounded import rounded_up
from rbstab.experiment.answers.state_words import angles
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import OPEN_RANGE, start_bounds
from rbstab.mechanics.states import PITCH
from rbstab.proof.entries import ProvedState
from rbstab.proof.exact.expr import Expr
from rbstab.proof.kept_range import (
    Border,
    border_of_pitch,
    energy_at_most,
    energy_bound,
    guard_energy,
    kept_record,
    nothing_rests_beyond,
)
from rbstab.proof.model import RANGE_END

METHODS = tuple(
    method
    for method, kind in KINDS["guard"].items()
    if method is not None and issubclass(kind, SoftGuard)
)
"""The methods of soft guards."""

DIGITS = 3
"""The least strength is found among the numbers with so many digits."""

MOST_STRENGTH = 1e12
"""N m/rad or N m: stronger guards are not looked for; the start is too close to θ2 = ±π/2."""

SURE = 1.0 + 1e-15
"""A factor on an angle that is more than its rounding."""


class NotDecidedError(Exception):
    """Nothing can be proved of a start with a soft guard; the text is the reason."""


@dataclass(frozen=True)
class SoftLaw:
    """The law of a soft guard.

    Args:
        method: One of `METHODS`.
        strength: k, N m/rad, or K, N m.
        soft_angle: θ_s, rad, between 0 and π/2.
    """

    method: str
    strength: float
    soft_angle: float

    @property
    def kind(self) -> Any:
        """The class of the guard."""
        return KINDS["guard"][self.method]

    @property
    def gains(self) -> dict[str, float]:
        """The gains of the guard by their names; the first is its strength."""
        return {self.kind.gains[0].name: self.strength, "soft_angle": self.soft_angle}

    @cached_property
    def energy(self) -> Expr:
        """Its energy, J."""
        return guard_energy(self.kind, self.strength, self.soft_angle)

    @property
    def couple_bound(self) -> float:
        """A bound of its couple while |θ2| < π/2, N m: that at the end."""
        guard = self.kind(name="guard", mode=np.array([1.0, 0.0]), **self.gains)
        return float(guard.slope(RANGE_END[PITCH]))


class Kept(NamedTuple):
    """What is proved of one start with one guard.

    Attributes:
        energy: An upper bound of the energy at the start, with that of the guard, J.
        energy_bound: Motions with less energy keep the range, J.
        states: The rest states to one of which the motion converges; empty if it is not decided.
        reason: Why it is not decided.
    """

    energy: float
    energy_bound: float
    states: tuple[ProvedState, ...]
    reason: str

    @property
    def convergence(self) -> str:
        """Where the motion goes, as text."""
        if not self.states:
            return f"not decided: {self.reason}"
        if len(self.states) > 1:
            return f"to one of {len(self.states)} rest states: proved"
        return f"to the rest state at Θ = {angles(self.states[0].orientation)} rad: proved"


class Unguarded(NamedTuple):
    """A start without a guard, and what is proved of it.

    Attributes:
        proof: The rest states of the config without the guard.
        border: The least energy on θ2 = ±π/2 without the guard.
        energy: An upper bound of the energy at the start, J.
        pitch: An upper bound of |θ2| at the start, rad.
    """

    proof: Proof
    border: Border
    energy: float
    pitch: float

    @property
    def is_inside(self) -> bool:
        """Whether the motion keeps the range without any guard."""
        return self.energy < self.border.energy

    def energy_with(self, law: SoftLaw) -> float:
        """Return an upper bound of the energy at the start with a guard, J."""
        return float(np.nextafter(self.energy + energy_at_most(law.energy, self.pitch), np.inf))

    def keeps_range(self, law: SoftLaw) -> bool:
        """Return whether the motion with a guard is proved to keep the range."""
        return self.energy_with(law) < energy_bound(self.border, law.energy)

    def least_law(self, method: str, soft_angle: float) -> SoftLaw:
        """Return the weakest guard, in `DIGITS` digits, that is proved to keep the range.

        Its energy at θ2 = ±π/2 is its strength times a number, so this is a closed form.

        Raises:
            NotDecidedError: Its strength is larger than `MOST_STRENGTH`.
        """
        unit = SoftLaw(method, 1.0, soft_angle).energy
        room = energy_at_most(unit, math.pi / 2) - energy_at_most(unit, self.pitch)
        strength = (self.energy - self.border.energy) / room if room > 0 else math.inf
        if not strength < MOST_STRENGTH:
            raise NotDecidedError("the start is too close to θ2 = ±π/2 for a soft guard")
        law = SoftLaw(method, float(rounded_up(strength, DIGITS)), soft_angle)
        while not self.keeps_range(law):
            more = law.strength * (1 + 0.5 * 10.0**-DIGITS)
            law = SoftLaw(method, float(rounded_up(more, DIGITS)), soft_angle)
        return law

    def kept(self, law: SoftLaw) -> Kept:
        """Return what is proved of the start with a guard that keeps the range, and is confirmed.

        Raises:
            NotDecidedError: The checker does not confirm that it keeps the range.
        """
        from rbstab.proof.check import check

        stored = self.proof.reduced_energy
        assert stored is not None
        nothing = nothing_rests_beyond(stored.energy, self.border, law.energy, law.soft_angle)
        bound = energy_bound(self.border, law.energy)
        inner = law.soft_angle if nothing else math.pi
        claimed = kept_record(stored.energy, self.border, law.energy, bound, inner)
        refused = {
            finding.claim: finding.text for finding in check(claimed) if not finding.verified
        }
        nothing = nothing and refused.pop("no other rest state", None) is None
        if refused:
            raise NotDecidedError(f"the checker refuses it: {' '.join(refused.values())}")
        states, reason = _inner_states(self.proof, law.soft_angle, nothing_beyond=nothing)
        return Kept(self.energy_with(law), bound, states, reason)


def unguarded(config: Config) -> Unguarded:
    """Prove what is needed of a config without its guard.

    Raises:
        NotDecidedError: The energy has no form that is proved, or no bounds.
    """
    problem = problem_of(config)
    proof = prove(config, problem)
    if proof.reduced_energy is None:
        turns = "no element reads Euler angles, so the proof is about rotations and has no range"
        raise NotDecidedError(proof.outcome if proof.on_rotations is None else turns)
    energy = proof.reduced_energy.energy
    if not energy.U.is_polynomial:
        raise NotDecidedError(
            "the least soft guard is not looked for beside springs, ligaments and some elements "
            "of users"
        )
    if energy.stop is not None:
        raise NotDecidedError("a stop keeps every motion in the range")
    border, start = border_of_pitch(energy), start_bounds(problem)
    if border is None:
        raise NotDecidedError("θ1 and θ3 have no bound that is small enough for a proof")
    if start is None:
        raise NotDecidedError("the energy at the start has no proved bound")
    pitch = float(max(-start.low[PITCH], start.high[PITCH]))
    if not pitch <= OPEN_RANGE[PITCH]:
        raise NotDecidedError("the start is not in the range |θ2| < π/2")
    return Unguarded(proof, border, start.energy, pitch)


def _inner_states(
    proof: Proof, soft_angle: float, *, nothing_beyond: bool
) -> tuple[tuple[ProvedState, ...], str]:
    """Return the rest states with the guard, or none and the reason why they are not known."""
    wide = proof.unwrapped
    if wide is None or not wide.proved:
        return (), "the rest states for all real θ1 and θ3 are not proved"
    if not nothing_beyond:
        return (), "a rest state beyond the soft angle is not excluded"
    inner = []
    for state in wide.states:
        low, high = (corner[PITCH] for corner in state.enclosure)
        if max(-low, high) * SURE < soft_angle:
            inner.append(state)
        elif not max(low, -high) > soft_angle * SURE:
            return (), "a rest state lies at the soft angle"
    return tuple(inner), "" if inner else "no rest state lies within the soft angle"
