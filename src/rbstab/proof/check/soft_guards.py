"""Check the energy below which a soft guard keeps every motion in the range: theorem 11.

The guard adds ½ k (|θ2| - θ_s)² or K (|θ2| - θ_s) beyond its soft angle θ_s to the energy U of a
proof. All else is computed anew, as in `checker`.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from flint import arb, ctx

from rbstab.proof.check.checker import PRECISION, confinement
from rbstab.proof.check.cover import cover, flattened
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import EVERYWHERE, Box, Finding, RefusedError, TooLongError
from rbstab.proof.check.least import bounds
from rbstab.proof.check.ranges import FARTHEST_END, Range
from rbstab.proof.check.taylor import Ball

METHODS = ("stiff", "repelling")


def check_soft_guard(energy: Mapping[str, Any], claim: Mapping[str, Any]) -> list[Finding]:
    """Check that motions below an energy keep the range, and that nothing rests beyond θ_s.

    Args:
        energy: The energy of the record of a proof without the guard.
        claim: `method`, `strength` (k or K), `soft_angle`, `end` (of θ1 and θ3, at least), `border`
            and `energy_bound`, J, and `nothing_beyond`.
    """
    findings = list[Finding]()
    with ctx.workprec(PRECISION):
        try:
            for finding in _findings(energy, claim):
                findings.append(finding)
        except (RefusedError, TooLongError) as error:
            findings.append(Finding(EVERYWHERE, "soft guard", False, f"{error}."))
    return findings


def _decimal(number: float) -> Ball:
    """Return a ball about the number that a double of a config means: its shortest decimal."""
    return arb(repr(float(number)))


def _findings(energy: Mapping[str, Any], claim: Mapping[str, Any]) -> Iterator[Finding]:
    U = Energy(energy["operations"], (0, 1, 2, *energy["free"]))
    if U.free or U.steps or energy["closed"] or energy["stop"] is not None:
        raise RefusedError("something else switches, closes the range, or moves beside the body")
    strength, soft_angle = (_decimal(claim[key]) for key in ("strength", "soft_angle"))
    sound = claim["method"] in METHODS and strength > 0
    if not (sound and soft_angle > 0 and soft_angle < arb.pi() / 2):
        raise RefusedError("the guard is not one that adds energy beyond an angle from 0 to π/2")
    range_ = _range_of(claim["end"])
    ends = confinement(U, range_)
    yield ends
    if not ends.verified:
        return
    yield _border(U, claim["border"], range_)
    room = arb.pi() / 2 - soft_angle
    added = strength * room if claim["method"] == "repelling" else strength * room * room / 2
    verified = bool(arb(claim["energy_bound"]) <= arb(claim["border"]) + added)
    text = f"Every motion with an energy below {claim['energy_bound']:.10g} J keeps the range"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    yield Finding(EVERYWHERE, "range", verified, text)
    if claim["nothing_beyond"]:
        yield _nothing_beyond(U, claim["method"], strength, soft_angle, range_)


def _range_of(end: Any) -> Range:
    """Return the range of all |θ2| <= π/2, up to some ends of θ1 and θ3.

    With a definite block k of K the energy grows with |θ1| and |θ3|, so it has lowest points on
    θ2 = ±π/2; these lie within the bound of theorem 6 as well.
    """
    first, _, third = (arb(float(one)) for one in end)
    if not (0 < first < FARTHEST_END and 0 < third < FARTHEST_END):
        raise RefusedError("θ1 or θ3 has no proper end")
    ends = first, arb.pi() / 2, third
    high = [math.nextafter(float(one.upper()), math.inf) for one in ends]
    return Range(EVERYWHERE, ends, tuple((-x, x) for x in high), frozenset(), None)


def _border(U: Energy, border: float, range_: Range) -> Finding:
    """Check that U without the guard is at least `border` on θ2 = ±π/2."""
    bound, covers = arb(border), {}
    for face in range_.faces(1):

        def reason(box: Box, place: Ball = face.place) -> str | None:
            return "b" if bounds(U, box, (1, place)).at_least(bound) else None

        covers[face.name] = cover(flattened(range_.box, 1), reason)
    verified = all(found.open is None for found in covers.values())
    text = f"Without the guard the energy on θ2 = ±π/2 is at least {border:.10g} J"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(EVERYWHERE, "border", verified, text, covers)


def _nothing_beyond(
    U: Energy, method: str, strength: Ball, soft_angle: Ball, range_: Range
) -> Finding:
    """Cover θ_s <= |θ2| <= π/2 by boxes in which the gradient and the guard do not balance."""

    def slope(nearest: float, farthest: float) -> Ball:
        """Return the slope of the guard for |θ2| between two angles; at θ_s any between its own."""
        if method == "stiff":
            excess = arb(nearest).union(arb(farthest)) - soft_angle
            return strength * excess.max(arb(0))
        return strength if arb(nearest) > soft_angle else strength.union(arb(0))

    def reason(box: Box) -> str | None:
        low, high = box[1]
        gradient = bounds(U, box).slopes
        gradient[1] += slope(low, high) if low > 0 else -slope(-high, -low)
        for axis, entry in enumerate(gradient, start=1):
            if not entry.contains(0):
                return f"g{axis}"
        return None

    first, (_, end), third = range_.box
    begin = float(soft_angle.lower()) * (1 - 1e-15)
    slabs: dict[str, Box] = {
        "θ2 >= θ_s": (first, (begin, end), third),
        "θ2 <= -θ_s": (first, (-end, -begin), third),
    }
    covers = {name: cover(box, reason) for name, box in slabs.items()}
    wrong = [found.open for found in covers.values() if found.open is not None]
    text = "With the guard no rest state has |θ2| >= θ_s."
    if wrong:
        shown = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in wrong[0])
        text = f"The box {shown} may contain a rest state."
    return Finding(EVERYWHERE, "nothing at rest beyond", not wrong, text, covers)
