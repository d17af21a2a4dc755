"""Check a proof for a tied body in six variables: `docs/proofs.md`, theorem 12.

From the proof come only its claims: the energy W, the enclosures of the rest states, their indices,
and the bound of the region. All the rest is computed here anew, in balls of 128 bits.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from flint import arb, ctx

from rbstab.analysis.proof_check.boxes import Box, box_between, shown, within
from rbstab.analysis.proof_check.checker import FARTHEST_END, PLACE_LIMIT, PRECISION
from rbstab.analysis.proof_check.claims import RestState
from rbstab.analysis.proof_check.confinement import confined
from rbstab.analysis.proof_check.cover import cover
from rbstab.analysis.proof_check.energy import TooLongError
from rbstab.analysis.proof_check.findings import (
    IN_RANGE,
    TIME,
    UNWRAPPED,
    Finding,
    Range,
    range_with,
)
from rbstab.analysis.proof_check.tied.extent import BoundedEnergy
from rbstab.analysis.proof_check.tied.regions import check_region
from rbstab.analysis.proof_check.tied.rest_states import (
    domain,
    domain_of_undecided,
    faults,
    no_zero,
    tied_states,
)
from rbstab.analysis.proof_check.trigonometric import Ball

BEYOND = 4
"""With a barrier, tan θ2 (or tan θ/2) at the end of the checked range is larger by this factor."""


def check_tied(
    proof: Mapping[str, Any], progress: Callable[[Finding], None] = lambda _: None
) -> list[Finding]:
    """Check the rest states of a proof and its region, for both ranges of Θ.

    Args:
        proof: A proof as plain data, with `tied_energy`.
        progress: Called with each finding as soon as it is made.

    Returns:
        The findings. The proof is verified if all of them are.
    """
    findings = list[Finding]()
    with ctx.workprec(PRECISION):
        try:
            W = BoundedEnergy(proof["tied_energy"])
            for finding in _all_findings(W, proof):
                findings.append(finding)
                progress(finding)
        except TooLongError as error:
            about = findings[-1].about if findings else IN_RANGE
            findings.append(Finding(about, TIME, False, f"{error}."))
        except ValueError as error:
            findings.append(Finding(IN_RANGE, "energy", False, f"{error}."))
    return findings


def _all_findings(W: BoundedEnergy, proof: Mapping[str, Any]) -> Iterator[Finding]:
    found = list[Finding]()
    for finding in _findings_between(W, proof, IN_RANGE, arb.pi(), arb.pi()):
        found.append(finding)
        yield finding
    if proof.get("closed"):
        yield _every_start(W, proof, found, IN_RANGE)
    wide = proof["unwrapped"]
    if wide is None:
        return
    if W.U.barrier_on(0) is not None:
        text = "Barriers on θ1 and θ3 divide this range, so that it has no proof."
        yield Finding(UNWRAPPED, "barrier", False, text)
        return
    first, third = arb(wide["end"][0]), arb(wide["end"][2])
    range_ = range_with(UNWRAPPED, (first, arb.pi() / 2, third))
    ends = _confined(W, range_)
    yield ends
    found = [ends]
    if ends.verified:
        for finding in _findings_between(W, wide, UNWRAPPED, first, third):
            found.append(finding)
            yield finding
    if wide.get("every_start"):
        yield _every_start(W, wide, found, UNWRAPPED)


def _every_start(
    W: BoundedEnergy, claims: Mapping[str, Any], found: Sequence[Finding], about: str
) -> Finding:
    """Check that barriers close the range, and that there is one rest state, a minimum."""
    if W.lines:
        text = "A spring may lose its length, so that every start converges is not shown."
        return Finding(about, "every start", False, text)
    states = tied_states(claims)
    single = bool(claims["proved"]) and len(claims["states"]) == len(states) == 1
    single = single and states[0].is_minimum
    single = single and "no other rest state" in {finding.claim for finding in found}
    closed = W.U.barrier_on(1) is not None
    closed = closed and (about == UNWRAPPED or W.U.barrier_on(0) is not None)
    verified = closed and single and all(finding.verified for finding in found)
    inside = "with |θ2| < π/2" if about == UNWRAPPED else "in the range of eq. 5"
    text = f"Every motion that starts {inside} converges to the rest state"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(about, "every start", verified, text)


def _findings_between(
    W: BoundedEnergy, claims: Mapping[str, Any], name: str, first: Ball, third: Ball
) -> Iterator[Finding]:
    """Check the claims on the range |θ1| < first, |θ2| < π/2, |θ3| < third.

    With a barrier, W rises with its angle's size from some angle on: a bound on the slope of all
    else holds for all z that matter. So there is no rest state from there on, and W is larger there
    than on the faces of a range that ends at any such angle. This range is checked instead.
    """
    ends = [first, arb.pi() / 2, third]
    for barrier in W.U.barriers:
        angle = f"|θ{barrier.axis + 1}|"
        end = W.U.end_before(barrier, first, third)
        if end is None:
            text = f"That W rises with {angle} near the end of the range could not be confirmed."
            yield Finding(name, "barrier", False, text)
            return
        text = f"W rises with {angle} from {end:.6g} rad on: no rest state is there."
        yield Finding(name, "barrier", True, text)
        # A larger end has a higher border: that of the prover may be a little larger than `end`.
        share = 1 if barrier.axis == 1 else 2
        farther = arb(float(share * (BEYOND * arb(end / share).tan()).atan()))
        ends[barrier.axis] = min(ends[barrier.axis], farther, key=float)
    yield from _findings(W, claims, range_with(name, (*ends,)))


def _confined(W: BoundedEnergy, range_: Range) -> Finding:
    """Check by theorem 6 that there is no rest state beyond the ends of θ1 and θ3."""
    first, _, third = range_.ends
    near = W.periodic and first < FARTHEST_END and third < FARTHEST_END
    verified = near and confined(W.U, first, third)
    text = f"All of them have |θ1| < {float(first):.5g} and |θ3| < {float(third):.5g} rad"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(range_.name, "ends", verified, text)


def _findings(W: BoundedEnergy, claims: Mapping[str, Any], range_: Range) -> Iterator[Finding]:
    """Check the claims on one range."""
    name = "rest states"
    if sum(len(claims[key]) for key in ("states", "undecided", "regions")) > PLACE_LIMIT:
        text = f"There are more than {PLACE_LIMIT} rest states and boxes: too many to check."
        yield Finding(range_.name, name, False, text)
        return
    states = tied_states(claims)
    wrong = list(faults(W, states, range_)) or _miscounts(claims, states)
    text = f"{len(states)} of {len(claims['states'])} are isolated, each in its enclosure."
    yield Finding(range_.name, name, not wrong, " ".join(wrong) or text)
    region = claims["region"]
    has_bound = region is not None and region["energy_bound"] is not None
    # All that follows builds on the rest states.
    if wrong or not (claims["proved"] or has_bound):
        return
    boxes = [box_between(corners) for corners in claims["undecided"]]
    undecided = {f"undecided box {n}": box for n, box in enumerate(boxes, start=1)}
    others = _others(W, states, undecided, range_)
    yield others
    if others.verified and has_bound and states:
        yield check_region(W, region, states, undecided, range_)


def _miscounts(claims: Mapping[str, Any], states: list[RestState]) -> list[str]:
    """Return what is wrong with the claims on the number of rest states."""
    if claims["regions"]:
        return ["Regions of single minima are not proved for a tied body with springs."]
    if len(states) != len(claims["states"]):
        return ["Not each of the rest states is proved."]
    if claims["proved"] and claims["undecided"]:
        return ["The rest states are said to be all, but some boxes are undecided."]
    expected = len(states) == 1 if claims["proved"] else False if len(states) > 1 else None
    if claims["unique"] != expected:
        return ["Whether there is one rest state does not follow from those that are listed."]
    return []


def _others(
    W: BoundedEnergy, states: list[RestState], undecided: Mapping[str, Box], range_: Range
) -> Finding:
    """Cover a range by boxes of Θ that have no rest state but those listed."""
    places = [domain(W, state.enclosure) for state in states]
    wider = (domain_of_undecided(W, box) for box in undecided.values())
    places += [one for one in wider if one is not None]

    def reason(box: Box) -> str | None:
        for number, one in enumerate(undecided.values(), start=1):
            if within(box, one):
                return f"u{number}"
        return "z" if no_zero(W, box, places) else None

    found = cover(range_.box, reason)
    outside = f" outside of {len(undecided)} undecided boxes" if undecided else ""
    text = f"There is no other{outside}."
    if found.open is not None:
        text = f"The box {shown(found.open)} may contain one that is not listed."
    claim = "no other rest state"
    return Finding(range_.name, claim, found.open is None, text, {"range": found})
