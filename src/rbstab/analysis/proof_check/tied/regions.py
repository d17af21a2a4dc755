"""Check the certified region of a tied body in six variables: W is high enough all around it.

These places are the faces of the range, over all z, the other rest states, undecided boxes, and
where a line has no length. On a face the least W over z has ∂W/∂z = 0. All z of this kind are
enclosed, and W is expanded about a point near them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box, flat, shown
from rbstab.analysis.proof_check.claims import RestState
from rbstab.analysis.proof_check.cover import Cover, cover
from rbstab.analysis.proof_check.findings import Finding, Range
from rbstab.analysis.proof_check.tied.energy import SIX, Pose
from rbstab.analysis.proof_check.tied.extent import BoundedEnergy
from rbstab.analysis.proof_check.tied.rest_states import (
    Expansion,
    all_settled,
    block_of_shift,
)
from rbstab.analysis.proof_check.trigonometric import Ball, square

STEPS = 8
"""The number of steps by which a point z near those with ∂W/∂z = 0 is found."""


def check_region(
    W: BoundedEnergy,
    claim: Mapping[str, Any],
    states: Sequence[RestState],
    undecided: Mapping[str, Box],
    range_: Range,
) -> Finding:
    """Check that W is at least `energy_bound` around the region of rest state 1.

    Args:
        W: The energy.
        claim: `energy_bound` and `lower_bound`, J.
        states: The rest states.
        undecided: The undecided boxes of Θ, by name.
        range_: The range.
    """
    bound = arb(claim["energy_bound"])
    shown_bound = f"{claim['energy_bound']:.10g} J"
    covers = dict[str, Cover]()
    for face in range_.faces:
        place = (face.axis, face.place)
        covers[face.name] = _cover(W, bound, flat(range_.box, face.axis), place)
    for name, box in undecided.items():
        covers[name] = _cover(W, bound, box)
    for k in range(len(W.lines)):
        covers[f"line {k + 1} without length"] = _cover_without_length(W, bound, range_.box, k)
    wrong = [
        f"The energy at {name} is not shown to be at least {shown_bound}, in {shown(found.open)}."
        for name, found in covers.items()
        if found.open is not None
    ]
    lowest, *others = states
    wrong += [
        f"The energy of {state.name} is not shown to be at least {shown_bound}."
        for state in others
        if not Expansion(W, state.enclosure).over.value >= bound
    ]
    if not (lowest.is_minimum and lowest.number == 1):
        wrong.append("Rest state 1 is not proved to be a minimum.")
    # W is convex on the enclosure of a minimum, so there W is nowhere below that of rest state 1.
    height = bound - Expansion(W, lowest.enclosure).at_centre.value
    if not height >= arb(claim["lower_bound"]):
        wrong.append(f"It is not shown to be {claim['lower_bound']:.10g} J above rest state 1.")
    text = f"Every motion with an energy below {shown_bound} converges to rest state 1."
    return Finding(range_.name, "certified region", not wrong, " ".join(wrong) or text, covers)


def _cover(
    W: BoundedEnergy, bound: Ball, place: Box, face: tuple[int, Ball] | None = None
) -> Cover:
    """Cover a place by boxes of Θ in which the least W over z is at least a bound."""

    def reason(box: Box) -> str | None:
        pose = Pose(W, box, face)
        centre = _near_stationary(pose)
        width = max(float(one.abs_upper()) for one in pose.step)

        def settled(part: Box) -> bool:
            z = [arb(low).union(arb(high)) for low, high in part]
            return _is_above(pose, centre, z, bound)

        high = all_settled(pose, W.scale, settled, lambda values: values.value >= bound, width)
        return "b" if high else None

    return cover(place, reason)


def _near_stationary(pose: Pose) -> list[Ball]:
    """Return a point z near one with ∂W/∂z = 0 at the centre of a box of Θ."""
    z = [arb(0)] * 3
    for _ in range(STEPS):
        values = pose.at(z)
        if not pose.W.is_smooth:
            z = [one.mid() for one in values.shift]
            continue
        H = block_of_shift(values).mid()
        try:
            step = H.solve(arb_mat([[one.mid()] for one in values.gradient[3:]]))
        except ZeroDivisionError:
            break
        z = [(one - step[i, 0]).mid() for i, one in enumerate(z)]
    return z


def _is_above(pose: Pose, centre: Sequence[Ball], z: Sequence[Ball], bound: Ball) -> bool:
    """Return whether W >= bound: W = value + gradient'δ + ½ δ'Hδ about the centre."""
    at_centre = pose.at(centre)
    hull = [one.union(point) for one, point in zip(z, centre, strict=True)]
    H = pose.at(hull, "over").hessian
    away = [one - point for one, point in zip(z, centre, strict=True)]
    step = arb_mat([[one] for one in [*pose.step, *away]])
    linear = sum((at_centre.gradient[i] * step[i, 0] for i in SIX), arb(0))
    total = at_centre.value + linear
    for i in SIX:
        total += H[i, i] * square(step[i, 0].abs_upper()) * arb(0.25, 0.25)
        total += sum((H[i, j] * step[i, 0] * step[j, 0] for j in range(i)), arb(0))
    return bool(total >= bound)


def _cover_without_length(W: BoundedEnergy, bound: Ball, place: Box, line: int) -> Cover:
    """Cover the range by boxes in which W >= bound where a line has no length, so that z = -r."""

    def reason(box: Box) -> str | None:
        pose = Pose(W, box)
        values = []
        for where in ("centre", "over"):
            z = [-one[0] for one in pose.offset(line, where)]
            values.append(pose.at(z, where, without=line))
        at_centre, over = values
        if over.value >= bound:
            return "b"
        r = pose.offset(line, "over")
        total = at_centre.value
        for i in AXES:
            slope = over.gradient[i]
            slope -= sum((over.gradient[3 + k] * r[k][1][i] for k in AXES), arb(0))
            total += slope * pose.step[i]
        return "b" if total >= bound else None

    return cover(place, reason)
