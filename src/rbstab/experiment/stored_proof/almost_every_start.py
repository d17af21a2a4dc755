"""Almost every start: whether all motions but a set of measure zero end in stable rest states.

This is theorem 14 of docs/proofs.md. Each of its hypotheses is checked here, by its name there:
that no element may switch just at a rest state is one of them. Of a list among all rotations the
hypotheses of theorem 15 were checked where it was made (`proof/rotations/theorem.py`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.exact import decimals
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import switching_code, without_code
from rbstab.elements.element import NO_STATE, Element
from rbstab.elements.guards.soft_guards import StiffGuard
from rbstab.elements.ligament import Ligament
from rbstab.elements.spring import Spring
from rbstab.experiment.answers.wanted import wanted
from rbstab.experiment.stored_proof.data import ProofData
from rbstab.mechanics.numbers import Array
from rbstab.proof.entries import ProvedState
from rbstab.proof.passive.damping import why_not_damped
from rbstab.proof.rotations.theorem import why_indefinite

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


@dataclass(frozen=True)
class AlmostEveryStart:
    """What is proved of all starts but a set of measure zero.

    Args:
        proved: Whether almost every start, whose motion stays in the range and away from θ2 = ±90°,
            converges to a stable rest state; of a list among all rotations, almost every start.
        returns: Whether the body rests where it should in each rest state that is reached; None if
            nothing is proved.
        states: The numbers of the rest states that are reached, from 1 for the lowest.
        why: The first hypothesis that is not known to hold; empty if all of them do.
        tilts: The least and the largest tilt of these rest states, rad; (0, 0) if there are none.
        elsewhere: Whether it rests elsewhere in each of them.
    """

    proved: bool
    returns: bool | None = None
    states: tuple[int, ...] = ()
    why: str = ""
    tilts: tuple[float, float] = (0.0, 0.0)
    elsewhere: bool = False

    @property
    def outcome(self) -> str:
        """What almost every start does: returns, rests elsewhere, or "" for both or not known."""
        if self.returns:
            return "returns"
        return "rests elsewhere" if self.elsewhere else ""

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "proved": self.proved,
            "returns": self.returns,
            "states": list(self.states),
            "why": self.why,
        }


def almost_every_start(proof: ProofData) -> AlmostEveryStart:
    """Return whether almost every start converges to a stable rest state (theorem 14 or 15).

    Args:
        proof: The proof of the rest states of a config (`ProofData.of`); without one nothing is
            proved. No code of users runs.
    """
    config = proof.config
    why = next(_failing(proof, config), "")
    if why:
        return AlmostEveryStart(proved=False, why=why)
    reached = [n for n, state in enumerate(proof.states, start=1) if state.stable]
    aim = wanted(config)
    poses = [proof.states[n - 1].orientation for n in reached]
    tilts, returning = [aim.tilt(pose) for pose in poses], [aim.holds(pose) for pose in poses]
    return AlmostEveryStart(
        proved=True,
        returns=all(returning),
        states=tuple(reached),
        tilts=(min(tilts), max(tilts)),
        elsewhere=not any(returning),
    )


def _failing(proof: ProofData, config: Config | None) -> Iterator[str]:
    """Yield the hypotheses of theorem 14, or 15, that are not known to hold, one by one."""
    if proof.on_rotations is not None:
        if proof.on_rotations.why:
            yield proof.on_rotations.why
        return
    if not proof.proved:
        yield f"the list of rest states is not proved to be complete: {proof.ended}"
    if not any(state.stable for state in proof.states):
        yield "no rest state in the range is proved to be stable"
    for number, state in enumerate(proof.states, start=1):
        if not (state.proved and state.index_proved):
            yield f"whether rest state {number} is stable is not proved"
    unstable = [state for state in proof.states if state.index > 0]
    if not unstable:
        return
    if config is None:
        yield "it is not known what acts on the body: the config of the proof is needed"
        return
    # A motion near an unstable rest state may not leave it without damping (A3).
    exact = system_of(without_code(config), decimals)
    undamped, indefinite = why_not_damped(exact), why_indefinite(exact)
    if undamped is not None:
        yield f"without elements of your own, {undamped}"
    if indefinite:
        yield indefinite
    yield from _not_smooth(proof, config, unstable)


def _not_smooth(proof: ProofData, config: Config, unstable: list[ProvedState]) -> Iterator[str]:
    """Yield why forces may not be Lipschitz, or not smooth near an unstable rest state (A4, A5)."""
    for name in switching_code(config):
        yield f"{name} is an element of your own with switches, or with states of its own"
    for element in system_of(without_code(config)).elements:
        if isinstance(element, (StiffGuard, Ligament)):
            # Of a ligament, only its damper begins to act with a slope, and that where it is taut.
            first = 1 if isinstance(element, Ligament) else None
            smooth = isinstance(element, Ligament) and not element.damping > 0
            switches = (may_switch(proof, state, config, element.name, first) for state in unstable)
            if not smooth and any(switches):
                yield f"{element.name} may begin to act just at an unstable rest state"
        elif not _is_smooth(element):
            yield f"the force of {element.name} jumps, or is not shown to be smooth"


def _is_smooth(element: Element) -> bool:
    """Return whether the force of an element has continuous derivatives wherever |θ2| < π/2."""
    # A line with a rest length has a length in all motions that count.
    return element.smooth and not (isinstance(element, Spring) and not element.rest_length > 0)
