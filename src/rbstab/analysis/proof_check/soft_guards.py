"""Check the energy below which a soft guard keeps every motion in the range: theorem 11.

The guard adds ½ k (|θ2| - θ_s)² or K (|θ2| - θ_s) beyond its soft angle θ_s to the energy U of a
proof. All else is computed anew, as in `checker`.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from flint import arb, ctx

from rbstab.analysis.proof_check.boxes import Box, flat, shown
from rbstab.analysis.proof_check.checker import FARTHEST_END, PRECISION
from rbstab.analysis.proof_check.confinement import confined
from rbstab.analysis.proof_check.cover import cover
from rbstab.analysis.proof_check.energy import Energy, TooLongError
from rbstab.analysis.proof_check.findings import UNWRAPPED, Finding, Range, range_with
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import Ball

METHODS = ("stiff", "repelling")


def check_soft_guard(energy: Mapping[str, Any], claim: Mapping[str, Any]) -> list[Finding]:
    """Check that motions below an energy keep the range, and that nothing rests beyond θ_s.

    Args:
        energy: `reduced_energy` of a proof without the guard.
        claim: `method`, `strength` (k or K), `soft_angle`, `end` (of θ1 and θ3, at least), `border`
            and `energy_bound`, J, and `nothing_beyond`.
    """
    findings = list[Finding]()
    with ctx.workprec(PRECISION):
        try:
            U = Energy(energy)
            for finding in _findings(U, claim):
                findings.append(finding)
        except (TooLongError, ValueError) as error:
            findings.append(Finding(UNWRAPPED, "soft guard", False, f"{error}."))
    return findings


def decimal(number: float) -> Ball:
    """Return a ball about the number that a double of a config means: its shortest decimal."""
    return arb(repr(float(number)))


def _findings(U: Energy, claim: Mapping[str, Any]) -> Iterator[Finding]:
    strength, soft_angle = (decimal(claim[key]) for key in ("strength", "soft_angle"))
    added = (*U.barriers, *U.guards, *U.lines, *U.of_users)
    plain = not added and U.position is None
    sound = claim["method"] in METHODS and plain and strength > 0
    if not (sound and soft_angle > 0 and soft_angle < arb.pi() / 2):
        text = "The guard is not one that adds energy beyond an angle between 0 and π/2."
        yield Finding(UNWRAPPED, "soft guard", False, text)
        return
    first, third = arb(claim["end"][0]), arb(claim["end"][2])
    range_ = range_with(UNWRAPPED, (first, arb.pi() / 2, third))
    ends = _confined(U, range_)
    yield ends
    if not ends.verified:
        return
    yield _border(U, claim["border"], range_)
    room = arb.pi() / 2 - soft_angle
    added = strength * room if claim["method"] == "repelling" else strength * room * room / 2
    verified = bool(arb(claim["energy_bound"]) <= arb(claim["border"]) + added)
    text = f"Every motion with an energy below {claim['energy_bound']:.10g} J keeps the range"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    yield Finding(UNWRAPPED, "range", verified, text)
    if claim["nothing_beyond"]:
        yield _nothing_beyond(U, claim["method"], strength, soft_angle, range_)


def _confined(U: Energy, range_: Range) -> Finding:
    """Check that the lowest points of both ends, and all rest states, are in a range (theorem 6).

    With a definite block k of K the energy grows with |θ1| and |θ3|, so lowest points exist.
    """
    first, _, third = range_.ends
    close = first < FARTHEST_END and third < FARTHEST_END
    verified = close and confined(U, first, third)
    text = f"Lowest points and rest states have |θ1| < {float(first):.5g} and "
    text += f"|θ3| < {float(third):.5g} rad"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(range_.name, "ends", verified, text)


def _border(U: Energy, border: float, range_: Range) -> Finding:
    """Check that U without the guard is at least `border` on θ2 = ±π/2."""
    bound, covers = arb(border), {}
    for face in range_.faces:
        if face.axis != 1:
            continue
        place = (face.axis, face.place)
        covers[face.name] = cover(
            flat(range_.box, face.axis),
            lambda box, place=place: "b" if Taylor(U, box, place).stays_above(bound) else None,  # type: ignore[misc]
        )
    verified = all(found.open is None for found in covers.values())
    text = f"Without the guard the energy on θ2 = ±π/2 is at least {border:.10g} J"
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(range_.name, "border", verified, text, covers)


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
        gradient = Taylor(U, box).whole_gradient.entries()
        added = slope(low, high) if low > 0 else -slope(-high, -low)
        gradient[1] += added
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
        text = f"The box {shown(wrong[0])} may contain a rest state."
    return Finding(range_.name, "nothing at rest beyond", not wrong, text, covers)
