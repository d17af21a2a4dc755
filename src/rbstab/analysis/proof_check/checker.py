"""Check a proof by other means than those that made it: `docs/proofs.md`, theorems 1, 3 and 5.

From the proof come only its claims: the energy U, the enclosures of the rest states, their indices,
and the bounds of the regions. All the rest is computed here anew, in balls of 128 bits.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from flint import arb, ctx

from rbstab.analysis.proof_check.boxes import Box, box_between, shown, within
from rbstab.analysis.proof_check.claims import RestState
from rbstab.analysis.proof_check.confinement import confined
from rbstab.analysis.proof_check.cover import cover
from rbstab.analysis.proof_check.energy import Energy, TooLongError
from rbstab.analysis.proof_check.findings import (
    IN_RANGE,
    TIME,
    UNWRAPPED,
    Finding,
    Range,
    range_with,
)
from rbstab.analysis.proof_check.regions import Region
from rbstab.analysis.proof_check.rest_states import (
    domain,
    domain_of_undecided,
    faults,
    proved_states,
)
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import Ball, misses_zero

PRECISION = 128
"""Bits of a ball."""

PLACE_LIMIT = 1000
"""The most rest states, undecided boxes and regions of a range. A proof has some hundred."""

BEYOND_STOP = 1 + 2**-48
"""The range that is checked goes so far beyond a stop, so that the stop is inside."""

FARTHEST_END = 100
"""rad: the largest end of θ1 and θ3. Proofs end at 20."""


def check(
    proof: Mapping[str, Any], progress: Callable[[Finding], None] = lambda _: None
) -> list[Finding]:
    """Check the rest states of a proof and its regions, for both ranges of Θ.

    Args:
        proof: A proof as plain data, with `reduced_energy`.
        progress: Called with each finding as soon as it is made.

    Returns:
        The findings. The proof is verified if all of them are.
    """
    findings = list[Finding]()
    with ctx.workprec(PRECISION):
        try:
            U = Energy(proof["reduced_energy"])
        except ValueError as error:
            return [Finding(IN_RANGE, "energy", False, f"{error}.")]
        lines = _lines(U)
        findings += lines
        for finding in lines:
            progress(finding)
        if not all(finding.verified for finding in lines):
            return findings
        try:
            for finding in _all_findings(U, proof):
                findings.append(finding)
                progress(finding)
        except TooLongError as error:
            about = findings[-1].about if findings else IN_RANGE
            findings.append(Finding(about, TIME, False, f"{error}."))
    return findings


def _all_findings(U: Energy, proof: Mapping[str, Any]) -> Iterator[Finding]:
    wide = proof["unwrapped"]
    found = list[Finding]()
    for finding in _findings_between(U, proof, IN_RANGE, arb.pi(), arb.pi()):
        found.append(finding)
        yield finding
    if proof.get("closed"):
        yield _every_start(U, proof, found, IN_RANGE)
    if wide is None:
        return
    if U.barrier_on(0) is not None:
        text = "Barriers on θ1 and θ3 divide this range, so that it has no proof."
        yield Finding(UNWRAPPED, "barrier", False, text)
        return
    first, third = arb(wide["end"][0]), arb(wide["end"][2])
    ends = _confined(U, range_with(UNWRAPPED, (first, arb.pi() / 2, third)))
    found = [ends]
    if ends.verified:
        found += _findings_between(U, wide, UNWRAPPED, first, third)
    yield from found
    if wide.get("every_start"):
        yield _every_start(U, wide, found, UNWRAPPED)


def _findings_between(
    U: Energy, claims: Mapping[str, Any], name: str, first: Ball, third: Ball
) -> Iterator[Finding]:
    """Check the claims on the range |θ1| < first, |θ2| < π/2, |θ3| < third."""
    ends, closed = [first, arb.pi() / 2, third], set[int]()
    if U.stop is not None:
        ends[1], closed = arb(U.stop.angle.upper()) * BEYOND_STOP, {1}
        text = f"A stop keeps every motion at |θ2| <= {float(U.stop.angle):.6g} rad."
        yield Finding(name, "stop", True, text)
    for barrier in U.barriers:
        angle = f"|θ{barrier.axis + 1}|"
        end = U.end_before(barrier, first, third)
        if end is None:
            text = f"That U rises with {angle} near the end of the range could not be confirmed."
            yield Finding(name, "barrier", False, text)
            return
        text = f"U rises with {angle} from {end:.6g} rad on: no rest state is there."
        yield Finding(name, "barrier", True, text)
        closed.add(barrier.axis)
        ends[barrier.axis] = min(ends[barrier.axis], arb(end), key=float)
    yield from _findings(U, claims, range_with(name, (*ends,), closed=(*closed,)))


def _lines(U: Energy) -> list[Finding]:
    """Check that each spring has a length at each attitude, so that U is smooth."""
    if not U.springs:
        return []
    covers = {f"line {k}": line.lengths() for k, line in enumerate(U.springs, start=1)}
    wrong = [name for name, found in covers.items() if found.open is not None]
    text = "Each line has a length at each attitude."
    if wrong:
        text = f"That {', '.join(wrong)} has a length at each attitude could not be confirmed."
    return [Finding(IN_RANGE, "lines", not wrong, text, covers)]


def _every_start(
    U: Energy, claims: Mapping[str, Any], found: Sequence[Finding], about: str
) -> Finding:
    """Check theorem 10: barriers or a stop close the range, with one rest state, a minimum."""
    states = proved_states(claims)
    single = bool(claims["proved"]) and len(claims["states"]) == len(states) == 1
    single = (
        single
        and states[0].is_minimum
        and "no other rest state" in {finding.claim for finding in found}
    )
    closed = U.barrier_on(1) is not None or U.stop is not None
    closed = closed and (about == UNWRAPPED or U.barrier_on(0) is not None)
    verified = closed and single and all(finding.verified for finding in found)
    inside = "with |θ2| < π/2" if about == UNWRAPPED else "in the range of eq. 5"
    inside = inside if U.stop is None else "within the stop"
    text = f"Every motion that starts {inside} converges to the rest state"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(about, "every start", verified, text)


def _confined(U: Energy, range_: Range) -> Finding:
    """Check by theorem 6 that there is no rest state beyond the ends of θ1 and θ3."""
    first, _, third = range_.ends
    if not (first < FARTHEST_END and third < FARTHEST_END):
        text = f"The range of θ1 or θ3 goes beyond {FARTHEST_END} rad: too far to be checked."
        return Finding(range_.name, "ends", False, text)
    verified = confined(U, first, third)
    claim = f"All of them have |θ1| < {float(first):.5g} and |θ3| < {float(third):.5g} rad"
    text = f"{claim}." if verified else f"{claim}: this could not be confirmed."
    return Finding(range_.name, "ends", verified, text)


def _findings(U: Energy, claims: Mapping[str, Any], range_: Range) -> Iterator[Finding]:
    """Check the claims on one range."""
    states, name = proved_states(claims), "rest states"
    if sum(len(claims[key]) for key in ("states", "undecided", "regions")) > PLACE_LIMIT:
        things = "rest states, undecided boxes and regions"
        text = f"There are more than {PLACE_LIMIT} {things}: too many to check."
        yield Finding(range_.name, name, False, text)
        return
    wrong = list(faults(U, states, range_)) or _miscounts(claims, states)
    text = f"{len(states)} of {len(claims['states'])} are isolated, each in its enclosure."
    yield Finding(range_.name, name, not wrong, " ".join(wrong) or text)
    region = claims["region"]
    has_bound = region is not None and region["energy_bound"] is not None
    # All that follows builds on the rest states.
    if wrong or not (claims["proved"] or has_bound or claims["regions"]):
        return
    undecided = [box_between(corners) for corners in claims["undecided"]]
    others = _others(U, states, undecided, range_)
    yield others
    if others.verified:
        yield from _regions(U, claims, states, undecided, range_)


def _regions(
    U: Energy,
    claims: Mapping[str, Any],
    states: list[RestState],
    undecided: list[Box],
    range_: Range,
) -> Iterator[Finding]:
    """Check the region of theorem 3, which is that of rest state 1, and those of theorem 5."""
    places = {state.name: state.enclosure for state in states}
    places |= {f"undecided box {n}": box for n, box in enumerate(undecided, start=1)}
    minima = {state.number: state for state in states if state.index_proved and state.index == 0}
    region, listed = claims["region"], [(one["rest_state"], one) for one in claims["regions"]]
    if region is not None and region["energy_bound"] is not None:
        listed.insert(0, (1, region))
    for number, claim in listed:
        name = "certified region" if claim is region else f"region of rest state {number}"
        state = minima.get(number)
        if state is None:
            text = f"Rest state {number} is not proved to be a minimum."
            yield Finding(range_.name, name, False, text)
            continue
        others = {name: box for name, box in places.items() if name != state.name}
        one = Region(U, claim, state, others, range_)
        yield one.check_everywhere() if claim is region else one.check_component()


def _miscounts(claims: Mapping[str, Any], states: list[RestState]) -> list[str]:
    """Return what is wrong with the claims on the number of rest states."""
    if claims["proved"] and len(states) != len(claims["states"]):
        return ["The rest states are said to be all, but not each of them is proved."]
    if claims["proved"] and claims["undecided"]:
        return ["The rest states are said to be all, but some boxes are undecided."]
    expected = len(states) == 1 if claims["proved"] else False if len(states) > 1 else None
    if claims["unique"] != expected:
        return ["Whether there is one rest state does not follow from those that are listed."]
    return []


def _others(U: Energy, states: list[RestState], undecided: list[Box], range_: Range) -> Finding:
    """Cover a range by boxes that contain no rest state but those listed."""
    places = {f"s{state.number}": domain(U, state) for state in states}
    wider = (domain_of_undecided(U, box) for box in undecided)
    places |= {f"u{number}": box for number, box in enumerate(wider, start=1)}

    def reason(box: Box) -> str | None:
        """Return a place with a box in it, or a component of ∇U or Y∇U, or "j", without a zero."""
        for name, place in places.items():
            if within(box, place):
                return name
        taylor = Taylor(U, box)
        for axis, entry in enumerate(taylor.whole_gradient.entries(), start=1):
            if misses_zero(entry):
                return f"g{axis}"
        Y = taylor.inverse
        if Y is not None:
            turned = Y * taylor.gradient + (Y * taylor.slope) * taylor.step
            for axis, entry in enumerate(turned.entries(), start=1):
                if misses_zero(entry):
                    return f"y{axis}"
        return "j" if taylor.excludes_jumps else None

    found = cover(range_.box, reason)._replace(places=places)
    outside = f" outside of {len(undecided)} undecided boxes" if undecided else ""
    text = f"There is no other{outside}."
    if found.open is not None:
        text = f"The box {shown(found.open)} may contain one that is not listed."
    name = "no other rest state"
    return Finding(range_.name, name, found.open is None, text, {"range": found})
