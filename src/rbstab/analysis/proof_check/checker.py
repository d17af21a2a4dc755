"""Check a proof by other means than those that made it: `docs/proofs.md`, theorems 1 and 3.

From the proof come only its claims: the energy U, the enclosures of the rest states, their indices,
and the bound of the certified region. All the rest is computed here anew, in balls of 128 bits.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from flint import arb, arb_mat, ctx

from rbstab.analysis.proof_check.cover import Cover, cover
from rbstab.analysis.proof_check.energy import AXES, Ball, Box, Energy, Taylor, square

PRECISION = 128
"""Bits of a ball."""

IN_RANGE = "the range of eq. 5"
UNWRAPPED = "all θ1 and θ3"


class Range(NamedTuple):
    """The range |θ_i| < e_i.

    Attributes:
        name: Its name in sentences.
        ends: e, three balls, rad.
        box: A box of doubles that contains it.
    """

    name: str
    ends: tuple[Ball, ...]
    box: Box


class Finding(NamedTuple):
    """One claim of a proof, and whether it was verified.

    Attributes:
        about: The range of Θ.
        claim: The name of the claim.
        verified: Whether it is verified. If not, it is wrong, or could not be confirmed.
        text: Sentences: what was checked, or what is wrong.
        covers: The boxes by which it was checked, by the name of the place that they cover.
    """

    about: str
    claim: str
    verified: bool
    text: str
    covers: Mapping[str, Cover] = {}

    @property
    def boxes(self) -> int:
        """The number of boxes that were examined."""
        return sum(found.boxes for found in self.covers.values())


@dataclass(frozen=True)
class RestState:
    """One rest state of a proof.

    Attributes:
        number: From 1.
        index: The number of negative eigenvalues of the Hessian.
        index_proved: Whether the proof claims the index.
        point: Θ, rad.
        enclosure: The box that is claimed to contain exactly one zero of ∇U.
    """

    number: int
    index: int
    index_proved: bool
    point: Sequence[float]
    enclosure: Box


def check(proof: Mapping[str, Any]) -> list[Finding]:
    """Check the rest states of a proof and its certified region, for both ranges of Θ.

    Args:
        proof: A proof as plain data, with `reduced_energy`.

    Returns:
        The findings. The proof is verified if all of them are.
    """
    with ctx.workprec(PRECISION):
        try:
            U = Energy(proof["reduced_energy"])
        except ValueError as error:
            return [Finding(IN_RANGE, "energy", False, f"{error}.")]
        half, wide = arb.pi() / 2, proof["unwrapped"]
        findings = list(_findings(U, proof, _range(IN_RANGE, (arb.pi(), half, arb.pi()))))
        if wide is not None:
            range_ = _range(UNWRAPPED, (arb(wide["end"][0]), half, arb(wide["end"][2])))
            findings += [_confined(U, range_), *_findings(U, wide, range_)]
        return findings


def _range(name: str, ends: tuple[Ball, ...]) -> Range:
    upper = [math.nextafter(float(end), math.inf) for end in ends]
    assert all(arb(high) > end for high, end in zip(upper, ends, strict=True))
    return Range(name, ends, tuple((-high, high) for high in upper))


def _confined(U: Energy, range_: Range) -> Finding:
    """Check by theorem 6 that there is no rest state beyond the ends of θ1 and θ3."""
    bound, (first, _, third) = U.confinement(), range_.ends
    verified = bound is not None and bool(bound[0] < first) and bool(bound[1] < third)
    claim = f"All of them have |θ1| < {float(first):.5g} and |θ3| < {float(third):.5g} rad"
    text = f"{claim}." if verified else f"{claim}: this could not be confirmed."
    return Finding(range_.name, "ends", verified, text)


def _findings(U: Energy, claims: Mapping[str, Any], range_: Range) -> Iterator[Finding]:
    """Check the claims on one range."""
    states = [
        RestState(
            number,
            one["index"],
            bool(one["index_proved"]),
            one["orientation"],
            _ends(one["enclosure"]),
        )
        for number, one in enumerate(claims["states"], start=1)
        if one["proved"]
    ]
    wrong = [text for state in states for text in _faults(U, state, range_)] + _overlaps(states)
    wrong = wrong or _miscounts(claims, states)
    text = f"{len(states)} of {len(claims['states'])} are isolated, each in its enclosure."
    yield Finding(range_.name, "rest states", not wrong, " ".join(wrong) or text)
    region = claims["region"]
    has_bound = region is not None and region["energy_bound"] is not None
    # All that follows builds on the rest states.
    if wrong or not (claims["proved"] or has_bound):
        return
    others = _others(U, states, claims, range_)
    yield others
    if others.verified and has_bound:
        yield _region(U, claims, states, range_)


def _faults(U: Energy, state: RestState, range_: Range) -> list[str]:
    """Return what is wrong with a rest state, as sentences."""
    box, name = state.enclosure, f"Rest state {state.number}"
    pairs = zip(box, state.point, strict=True)
    if not all(low <= angle <= high for (low, high), angle in pairs):
        return [f"{name}: its Θ is not in its enclosure."]
    if not all(arb(max(-box[i][0], box[i][1])) < range_.ends[i] for i in AXES):
        return [f"{name}: its enclosure is not inside {range_.name}."]
    taylor = Taylor(U, box)
    if not _is_unique(taylor):
        return [f"{name}: its enclosure may contain more than one zero of the gradient."]
    if not _exists(taylor, box):
        return [f"{name}: no zero of the gradient could be shown in its enclosure."]
    # All Hessians in the enclosure are regular, so one of them gives the index of all.
    index = _index(taylor.hessian)
    if state.index_proved and index != state.index:
        return [f"{name}: its index is {'not known' if index is None else index}."]
    return []


def _overlaps(states: list[RestState]) -> list[str]:
    """Return a sentence for each two rest states that may be the same."""
    pairs = ((one, two) for one in states for two in states if one.number < two.number)
    return [
        f"Rest states {one.number} and {two.number} may be the same."
        for one, two in pairs
        if all(one.enclosure[i][0] <= two.enclosure[i][1] for i in AXES)
        and all(two.enclosure[i][0] <= one.enclosure[i][1] for i in AXES)
    ]


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


def _index(H: Any) -> int | None:
    """Return the number of negative eigenvalues of a regular symmetric 3x3 matrix.

    If its determinant is positive, this number is 0 or 2. It is 0 if the trace t and the sum m of
    the principal minors are positive, and 2 if one of them is negative. If the determinant is
    negative, -H has a positive one, and 3 - n negative eigenvalues.
    """
    if H.det() < 0:
        opposite = _index(-H)
        return None if opposite is None else 3 - opposite
    t = sum((H[i, i] for i in AXES), arb(0))
    m = sum((H[i, i] * H[j, j] - square(H[i, j]) for i in AXES for j in range(i)), arb(0))
    if not H.det() > 0:
        return None
    if t > 0 and m > 0:
        return 0
    return 2 if t < 0 or m < 0 else None


def _others(
    U: Energy, states: list[RestState], claims: Mapping[str, Any], range_: Range
) -> Finding:
    """Cover a range by boxes that contain no rest state but those listed."""
    places = {f"s{state.number}": _domain(U, state) for state in states}
    for number, corners in enumerate(claims["undecided"], start=1):
        places[f"u{number}"] = _ends(corners)

    def reason(box: Box) -> str | None:
        """Return a place that contains a box, or a component of ∇U or Y∇U that has no zero."""
        for name, place in places.items():
            if _within(box, place):
                return name
        taylor = Taylor(U, box)
        for axis, entry in enumerate(taylor.whole_gradient.entries(), start=1):
            if not entry.contains(0):
                return f"g{axis}"
        Y = taylor.inverse
        if Y is not None:
            turned = Y * taylor.gradient + (Y * taylor.slope) * taylor.step
            for axis, entry in enumerate(turned.entries(), start=1):
                if not entry.contains(0):
                    return f"y{axis}"
        return None

    found = cover(range_.box, reason)._replace(places=places)
    undecided = len(claims["undecided"])
    outside = f" outside of {undecided} undecided boxes" if undecided else ""
    text = f"There is no other{outside}."
    if found.open is not None:
        text = f"The box {_shown(found.open)} may contain one that is not listed."
    name = "no other rest state"
    return Finding(range_.name, name, found.open is None, text, {"range": found})


def _domain(U: Energy, state: RestState) -> Box:
    """Return a large box about an enclosure in which there is no other zero."""
    radius = 2.0
    while radius > 1e-12:
        wide: Box = tuple((low - radius, high + radius) for low, high in state.enclosure)
        if _is_unique(Taylor(U, wide)):
            return wide
        radius *= 0.8
    return state.enclosure


def _region(
    U: Energy, claims: Mapping[str, Any], states: list[RestState], range_: Range
) -> Finding:
    """Check the bound of theorem 3: the border and all other rest states are not below it."""
    region, lowest, name = claims["region"], claims["states"][0], "certified region"
    if not (lowest["proved"] and lowest["index_proved"] and lowest["index"] == 0):
        text = "The lowest rest state is not proved to be a minimum."
        return Finding(range_.name, name, False, text)
    bound, wrong, covers = arb(region["energy_bound"]), list[str](), dict[str, Cover]()
    below = f"{region['energy_bound']:.10g} J"
    for place, box, face in _places(claims, states, range_):
        covers[place] = found = cover(box, _above(U, bound, face))
        if found.open is not None:
            wrong.append(f"The energy at {place} is not shown to be at least {below}.")
    # v counts from the lowest rest state.
    height = bound - Taylor(U, states[0].enclosure).values
    if not (region["lower_bound"] == 0 or arb(region["lower_bound"]) <= height):
        wrong.append(f"v < {region['lower_bound']:.10g} J is more than an energy below {below}.")
    text = f"Every motion with an energy below {below} converges to the lowest rest state."
    if height <= 0:
        text = f"It is empty: no motion has an energy below {below}."
    return Finding(range_.name, name, not wrong, " ".join(wrong) or text, covers)


def _places(
    claims: Mapping[str, Any], states: list[RestState], range_: Range
) -> Iterator[tuple[str, Box, tuple[int, Ball] | None]]:
    """Yield all places that must not be below the bound: the name, a box, and the flat axis."""
    for state in states[1:]:
        yield f"rest state {state.number}", state.enclosure, None
    for number, corners in enumerate(claims["undecided"], start=1):
        yield f"undecided box {number}", _ends(corners), None
    for axis in AXES:
        flat: Box = tuple((0.0, 0.0) if i == axis else range_.box[i] for i in AXES)
        for sign in (-1, 1):
            end = sign * range_.ends[axis]
            yield f"θ{axis + 1} = {float(end):.6g}", flat, (axis, end)


def _above(U: Energy, bound: Ball, face: tuple[int, Ball] | None) -> Callable[[Box], str | None]:
    """Return a function that gives the reason "b" for a box in which U is at least the bound."""
    return lambda box: "b" if Taylor(U, box, face).stays_above(bound) else None


def _ends(corners: Sequence[Sequence[float]]) -> Box:
    return tuple((low, high) for low, high in zip(*corners, strict=True))


def _within(box: Box, other: Box) -> bool:
    return all(other[i][0] <= box[i][0] and box[i][1] <= other[i][1] for i in AXES)


def _shown(box: Box) -> str:
    return " x ".join(f"[{low:.9g}, {high:.9g}]" for low, high in box)
