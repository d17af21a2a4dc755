"""When the convergence of exact motions is decided: by a region of a proof, or never."""

import math
from typing import TYPE_CHECKING

import numpy as np

from rbstab.elements.guards.stop import Stop
from rbstab.elements.sliding import Sliding, SlidingConnector
from rbstab.experiment.convergence.convergence import (
    ASK_FOR_PROOF,
    NO_PROOF,
    Convergence,
    Undecided,
    undecided,
)
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

NO_REGION = "no certified region is proved"

OUTSIDE = (
    f"the start is outside of every certified region; {ASK_FOR_PROOF} follows the exact motion"
)

BY_REGION = (Undecided.SWITCHES, Undecided.USER_CODE)
"""The reasons for which no motion is enclosed, while its start may be in a region."""

MAX_STEPS = 2000
"""Steps after which the enclosure of a motion ends: a limit that is the same on every machine. A
hundred steps take two to four seconds."""

BRIEF_STEPS = 150
"""Steps after which the enclosure ends if it was to be brief: some five seconds."""

PATIENCE = 50
"""Steps over which the energy must fall by `LEAST_FALL`; otherwise the motion has come to rest."""

LEAST_FALL = 1e-6
"""Relative to the energy that the motion has lost since its start."""


def convergence_at_start(problem: Problem, proof: "Proof | None") -> Convergence:
    """Return what a proof of the rest states says about the start of a problem.

    Args:
        problem: The problem.
        proof: The proof; None if there is none.
    """
    refused = refusal(problem, proof)
    # Where no motion is enclosed, there may be a region all the same, and this start in it.
    if proof is None or (refused is not None and refused.reason not in BY_REGION):
        assert refused is not None
        return refused
    # Imported late: most runs have no proof.
    from rbstab.experiment.stored_proof.starts import region_bounds, start_bounds

    start = start_bounds(problem) if proof.has_energy else None
    if start is not None:
        energy, box = (start.least, start.energy), (start.low, start.high)
        inside = convergence_in(proof, energy, box, 0.0)
        if inside is not None:
            return inside
    if refused is None:
        return undecided(Undecided.OUTSIDE, OUTSIDE)
    if region_bounds(proof):
        return refused
    only = f". Only a region could decide: {refused.why}" if proof.has_energy else ""
    return undecided(Undecided.NO_REGION, f"{no_region(proof)}{only}")


def refusal(problem: Problem, proof: "Proof | None") -> Convergence | None:
    """Return a convergence that no enclosure can decide, with the reason; None if one may."""
    refused = not_enclosed(problem)
    if refused is not None:
        return refused
    if proof is None:
        return undecided(Undecided.NO_REGION, NO_PROOF)
    # Imported late: most runs have no proof.
    from rbstab.experiment.stored_proof.data import GOES_ON
    from rbstab.experiment.stored_proof.starts import has_no_rest_state, region_bounds

    if has_no_rest_state(proof, at_poles=problem.quaternion):
        return Convergence(False, why="there is no rest state with |θ2| < π/2")
    if proof.proved and not proof.states:
        return undecided(Undecided.NO_REGION, "the range of eq. 5 has no rest state")
    if region_bounds(proof):
        return None
    goes_on = f"; {GOES_ON}" if proof.proved and proof.goes_on else ""
    return undecided(Undecided.NO_REGION, f"{no_region(proof)}{goes_on}")


def no_region(proof: "Proof") -> str:
    """Return that no region is proved, and why, if the list of rest states is not complete."""
    return NO_REGION if proof.proved else f"{NO_REGION} ({proof.ended})"


def not_enclosed(problem: Problem) -> Convergence | None:
    """Return a convergence that is not decided because no motion can be enclosed, or None.

    Either an element supplies power, or the equations are not smooth, or the code of a user has no
    formulas.
    """
    elements = problem.system.elements
    if any(element.from_user for element in elements):
        from rbstab.proof.motion.recorded import why_not_recorded

        why_not = why_not_recorded(problem.system)
        if why_not is not None:
            why = f"{why_not}, and only motions under formulas can be enclosed"
            return undecided(Undecided.USER_CODE, why)
    if problem.system.supplies:
        return undecided(Undecided.INPUT, "an element supplies power, so v may rise")
    if any(isinstance(element, SlidingConnector) for element in elements):
        why = "the force of a sliding connector jumps, and only smooth equations can be enclosed"
        return undecided(Undecided.SLIDING, why)
    for element in elements:
        stops, slides = isinstance(element, Stop), isinstance(element, Sliding)
        if stops or slides or element.holds or element.slides:
            how = "turns the motion back at once" if stops else "may slide on a surface"
            why = f"an element switches in a way that no enclosure follows: {element.name} {how}"
            return undecided(Undecided.SLIDING if slides else Undecided.SWITCHES, why)
    return None


def nothing_proved(problem: Problem) -> Convergence | None:
    """Return a convergence that is not decided as there is no proof of rest states, or None.

    That of a body with ligaments, soft guards or a stop may be proved, although they switch, and
    that of one with code of a user: the proof of its rest states says why there is none.
    """
    refused = not_enclosed(problem)
    return None if refused is None or refused.reason in BY_REGION else refused


def convergence_in(
    proof: "Proof", energy: tuple[float, float], box: tuple[Array, Array], t: float
) -> Convergence | None:
    """Return the convergence of all motions of a set if it is proved, else None.

    Args:
        proof: The proof of the rest states and of their regions.
        energy: Bounds on the sum of all energies, J.
        box: The smallest and the largest Θ, each of shape (3,), rad.
        t: The time, s.
    """
    from rbstab.experiment.stored_proof.starts import reached_states

    low, high = energy
    least, most = box
    (number,), (level,) = reached_states(proof, np.array([high]), least[None], most[None])
    if not number:
        return None
    rest = proof.states[number - 1].energy
    above = (math.nextafter(low - rest, -math.inf), math.nextafter(high - rest, math.inf))
    bound = math.inf if level == math.inf else math.nextafter(level - rest, -math.inf)
    return Convergence(True, rest_state=int(number), time=t, energy=above, bound=bound)
