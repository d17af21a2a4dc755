"""Check the energy below which a soft guard keeps every motion in the range: theorem 11.

The guard adds ½ k (|θ2| - θ_s)² or K (|θ2| - θ_s) beyond its soft angle θ_s to the energy U of a
proof. All else is computed anew, as in `checker`.
"""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

from flint import arb, ctx, fmpq

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.checker import PRECISION
from rbstab.proof.check.confine import confinement
from rbstab.proof.check.cover import cover, flattened
from rbstab.proof.check.energy import Energy, rational, read_energy
from rbstab.proof.check.findings import (
    EVERYWHERE,
    Box,
    Finding,
    RefusedError,
    TooLongError,
    confirmed,
)
from rbstab.proof.check.ranges import range_of

ORDERS = {"stiff": 2, "repelling": 1}
"""The power of |θ2| - θ_s in the energy of a guard."""


def check_soft_guard(energy: Mapping[str, Any], claim: Mapping[str, Any]) -> list[Finding]:
    """Check that motions below an energy keep the range, and that nothing rests beyond θ_s.

    Args:
        energy: The energy of the record of a proof without the guard.
        claim: `method`, `strength` (k or K), `soft_angle`, `end` (of θ1 and θ3, at least),
            `energy_bound`, J, and `nothing_beyond`.
    """
    findings = list[Finding]()
    with ctx.workprec(PRECISION):
        try:
            for finding in _findings(energy, claim):
                findings.append(finding)
                if not finding.verified:
                    break
        except (RefusedError, TooLongError) as error:
            findings.append(Finding(EVERYWHERE, "soft guard", False, f"{error}."))
    return findings


def _decimal(number: float) -> fmpq:
    """Return the number that a double of a config means: its shortest decimal."""
    return rational(str(Fraction(repr(float(number)))))


def _findings(energy: Mapping[str, Any], claim: Mapping[str, Any]) -> Iterator[Finding]:
    U = read_energy(energy["operations"], energy["free"])
    if U.free or U.steps or energy["closed"] or energy["stop"] is not None:
        raise RefusedError("something else switches, closes the range, or moves beside the body")
    strength, soft_angle = (_decimal(claim[key]) for key in ("strength", "soft_angle"))
    sound = claim["method"] in ORDERS and strength > 0
    if not (sound and soft_angle > 0 and soft_angle < arb.pi() / 2):
        raise RefusedError("the guard is not one that adds energy beyond an angle from 0 to π/2")
    # With a definite block k of K the energy grows with |θ1| and |θ3|, so it has lowest points on
    # θ2 = ±π/2; these lie within the bound of theorem 6 as well.
    first, _, third = (float(one) for one in claim["end"])
    range_, _ = range_of(U, energy, {"end": [first, "pi/2", third], "everywhere": True})
    yield confinement(U, range_)
    guarded = _with_guard(U, ORDERS[claim["method"]], strength, soft_angle)
    bound, covers = arb(claim["energy_bound"]), {}
    for face in range_.faces(1):

        def above(box: Box, flat: tuple[int, arb] = (1, face.place)) -> str | None:
            return "b" if Bounds(guarded, box, flat).at_least(bound) else None

        covers[face.name] = cover(flattened(range_.box, 1), above)
    text = f"Every motion with an energy below {claim['energy_bound']:.10g} J keeps the range"
    yield confirmed(EVERYWHERE, "range", text, covers)
    if claim["nothing_beyond"]:
        one, (_, end), three = range_.box
        begin = float(arb(soft_angle).lower()) * (1 - 1e-15)
        sides = {"θ2 >= θ_s": (begin, end), "θ2 <= -θ_s": (-end, -begin)}
        covers = {
            name: cover((one, side, three), lambda box: Bounds(guarded, box).excludes_zero())
            for name, side in sides.items()
        }
        text = "With the guard no rest state has |θ2| >= θ_s"
        yield confirmed(EVERYWHERE, "nothing at rest beyond", text, covers)


def _with_guard(U: Energy, order: int, strength: fmpq, soft_angle: fmpq) -> Energy:
    """Return U with the energy of a guard."""
    operations = list(U.operations)

    def put(*operation: Any) -> int:
        operations.append(operation)
        return len(operations) - 1

    terms, theta2 = [(fmpq(1), len(operations) - 1)], put("var", 1)
    for side in (1, -1):
        excess = put("sum", -soft_angle, ((fmpq(side), theta2),))
        power = put("pow", order, excess)
        terms.append((strength / order, put("times", power, put("step", order, excess))))
    put("sum", fmpq(0), tuple(terms))
    return Energy(operations)
