"""What is proved, what is only seen and what is false of one config."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.linearisation import Linearisation, linearise
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.experiment.proof import Proof, ProvedState, start_level, starts_inside
from rbstab.experiment.switching_record import resting_system
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import motion_from_centre


@dataclass(frozen=True, eq=False)
class Stability:
    """A config's rest states, its certified region, and where it starts.

    Args:
        proof: The rest states, lowest first, and the region.
        linearisations: That of each rest state, in their order.
        start: v(0) counted from the lowest rest state, J; None where there is none.
        inside: Whether the config starts where convergence to the lowest rest state is proved.
    """

    proof: Proof
    linearisations: tuple[Linearisation, ...]
    start: float | None
    inside: bool

    @property
    def statements(self) -> list[str]:
        """The answers in words: are these all rest states, can global stability hold, and here?"""
        return [*_on_rest_states(self.proof), *_on_region(self)]


def stability_of(config: Config, proof: Proof) -> Stability:
    """Everything that follows from a proof (or a search) for a config."""
    system = resting_system(problem_of(config))
    linearisations = []
    with np.errstate(all="ignore"):
        for state in proof.states:
            Z = np.concatenate([state.orientation, ZERO, state.position, ZERO])
            rest = motion_from_centre(system.body, system.anchor, Z)
            linearisations.append(linearise(system, rest, np.array(state.connector_state)))
        start = start_level(config, proof)
    return Stability(proof, tuple(linearisations), start, starts_inside(config, proof))


def kind_of(state: ProvedState) -> str:
    """Whether a rest state is stable (a minimum), a saddle, or a maximum of the stored energy."""
    return {0: "stable", 3: "maximum"}.get(state.index, f"saddle, index {state.index}")


def _on_rest_states(proof: Proof) -> list[str]:
    if not proof.states and not proof.proved:
        return [f"Rest states: nothing can be said: {proof.outcome}."]
    count, boxes = len(proof.states), f"{proof.examined} boxes"
    number = "1 rest state" if count == 1 else f"{count} rest states"
    if proof.proved:
        found = [f"Rest states: {number} in the range of eq. 5, proved to be all ({boxes})."]
    else:
        found = [f"Rest states: {number} found; not proved to be all: {proof.outcome}."]
    if proof.globally_stable:
        found.append("Globally stable: proved for every motion that stays in the range.")
    elif proof.unique:
        found.append("Globally stable: false, for the one rest state is no minimum.")
    elif proof.unique is False:
        other = ", ".join(f"{angle:.4g}" for angle in proof.states[1].orientation)
        found.append(f"Globally stable: false, for it also rests at Θ = ({other}) rad.")
    elif count > 1:
        found.append("Globally stable: not so, if the second of these is a rest state.")
    else:
        found.append("Globally stable: not decided.")
    return found


def _on_region(stability: Stability) -> list[str]:
    region, start = stability.proof.region, stability.start
    if region is None or start is None:
        return ["Certified region: none."]
    where = f"on {region.face}" if region.face else "at another rest state"
    if region.lower_bound > 0:
        found = [
            f"Certified region: all that starts with v < {region.lower_bound:.6g} J converges to "
            f"the lowest rest state, proved (c* is attained {where})."
        ]
    elif region.level > 0:
        found = [f"Certified region: v < {region.level:.6g} J, searched and not proved ({where})."]
    else:
        found = ["Certified region: empty."]
    if stability.inside:
        return [*found, f"This start: v(0) = {start:.6g} J is inside: it is proved to converge."]
    return [*found, f"This start: v(0) = {start:.6g} J is not inside: nothing is proved of it."]
