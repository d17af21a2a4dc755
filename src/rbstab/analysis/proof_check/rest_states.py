"""Check that each enclosure of a proof contains exactly one rest state, and with which index."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import combinations
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box, box_between, touches, width
from rbstab.analysis.proof_check.claims import RestState, fault_of
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.findings import Range
from rbstab.analysis.proof_check.held.angle import held_fault, held_unique, is_at_guard
from rbstab.analysis.proof_check.held.surface import surface_fault, surface_of, unique_on_surface
from rbstab.analysis.proof_check.taylor import Taylor
from rbstab.analysis.proof_check.trigonometric import square

NARROW = 1e-6
"""rad: wider boxes that are undecided are taken as they are."""


def proved_states(claims: Mapping[str, Any]) -> list[RestState]:
    """Return the rest states that are claimed to be isolated."""
    return [
        RestState(
            number,
            one["index"],
            bool(one["index_proved"]),
            one["orientation"],
            box_between(one["enclosure"]),
            bool(one.get("held")),
            bool(one.get("ridge")),
        )
        for number, one in enumerate(claims["states"], start=1)
        if one["proved"]
    ]


def faults(U: Energy, states: Sequence[RestState], range_: Range) -> Iterator[str]:
    """Yield what is wrong with the rest states, as sentences."""
    for state in states:
        fault = _fault(U, state, range_)
        if fault is not None:
            yield f"Rest state {state.number}: {fault}."
    for one, two in combinations(states, 2):
        if touches(one.enclosure, two.enclosure):
            yield f"Rest states {one.number} and {two.number} may be the same."


def _fault(U: Energy, state: RestState, range_: Range) -> str | None:
    """Return what is wrong with a rest state."""
    if state.held and U.kinks and not is_at_guard(U, state):
        return surface_fault(U, state, range_)
    if state.ridge:
        return "it is stored as a ridge, but no force pushes away from it"
    if state.held:
        return held_fault(U, state, range_)
    # Only an enclosure inside the range is expanded.
    taylor = cache(lambda: Taylor(U, state.enclosure))
    return fault_of(
        state,
        range_,
        unique=lambda: _is_unique(taylor()),
        exists=lambda: _exists(taylor(), state.enclosure),
        index=lambda: index_of(taylor().hessian),
    )


def domain(U: Energy, state: RestState) -> Box:
    """Return a large box about an enclosure in which there is no other rest state."""
    kink = None
    if state.held and not is_at_guard(U, state):
        kink = surface_of(U, state.enclosure)

    def unique(box: Box) -> bool:
        if not state.held:
            return _is_unique(Taylor(U, box))
        if kink is None:
            return held_unique(U, state, box)
        return unique_on_surface(U, kink, box)

    return _widest(state.enclosure, unique)


def domain_of_undecided(U: Energy, box: Box) -> Box:
    """Return a box about an undecided one that has no rest state outside of that.

    It is wider if a rest state is shown to be in the undecided one, as on the border of a range.
    """
    if width(box) > NARROW or not _exists(Taylor(U, box), box):
        return box
    return _widest(box, lambda wide: _is_unique(Taylor(U, wide)))


def _widest(box: Box, accept: Callable[[Box], bool]) -> Box:
    """Return a box widened as far as accepted, up to 2 rad; the box itself if it is never."""
    radius = 2.0
    while radius > 1e-12:
        wide: Box = tuple((low - radius, high + radius) for low, high in box)
        if accept(wide):
            return wide
        radius *= 0.8
    return box


def _is_unique(taylor: Taylor) -> bool:
    """Return whether Y∇U is one to one in a box: |I - YH| has a norm below 1 in all of it."""
    residual = _residual(taylor)
    if residual is None:
        return False
    sums = (sum((residual[i, j].abs_upper() for j in AXES), arb(0)) for i in AXES)
    return all(total < 1 for total in sums)


def _exists(taylor: Taylor, box: Box) -> bool:
    """Return whether Krawczyk's test finds a zero: m - Y∇U(m) + (I - YH)δ is inside the box."""
    residual = _residual(taylor)
    if residual is None:
        return False
    image = residual * taylor.step - taylor.inverse * taylor.gradient
    found = [taylor.centre[i] + image[i, 0] for i in AXES]
    return all(arb(low) < angle < arb(high) for (low, high), angle in zip(box, found, strict=True))


def _residual(taylor: Taylor) -> Any:
    """Return I - YH over the box; None if Y does not exist."""
    Y = taylor.inverse
    unit = arb_mat([[arb(int(i == j)) for j in AXES] for i in AXES])
    return None if Y is None else unit - Y * taylor.whole_hessian


def index_of(H: Any) -> int | None:
    """Return the number of negative eigenvalues of a regular symmetric 3x3 matrix.

    If its determinant is positive, this number is 0 or 2. It is 0 if the trace t and the sum m of
    the principal minors are positive, and 2 if one of them is negative. If the determinant is
    negative, -H has a positive one, and 3 - n negative eigenvalues.
    """
    if H.det() < 0:
        opposite = index_of(-H)
        return None if opposite is None else 3 - opposite
    t = sum((H[i, i] for i in AXES), arb(0))
    m = sum((H[i, i] * H[j, j] - square(H[i, j]) for i in AXES for j in range(i)), arb(0))
    if not H.det() > 0:
        return None
    if t > 0 and m > 0:
        return 0
    return 2 if t < 0 or m < 0 else None
