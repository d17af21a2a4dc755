"""What is proved of all disturbances below a bound: the answer, in words and as data."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from rbstab.config.tolerances import decimal_text
from rbstab.experiment.answers.rounded import LEVEL_DIGITS, number, rounded_up
from rbstab.files.text import grouped
from rbstab.proof.disturbed.forms import Load
from rbstab.proof.disturbed.invariant import Claim
from rbstab.proof.record import Record

DOCUMENTED = "docs/proofs.md"

UNITS = {"couple": "N m", "force": "N"}

Sizes = tuple[Fraction, ...]


@dataclass(frozen=True)
class Largest:
    """The largest loads, in the ratio of the given ones.

    Args:
        proved: The largest that were proved; None if none were.
        undecided: The smallest larger ones that were not; None if no others were tried.
        broken: The smallest that were found to break the bound; None if none were.
    """

    proved: Sizes | None
    undecided: Sizes | None
    broken: tuple[float, ...] | None


@dataclass(frozen=True)
class Bound:
    """Whether loads below bounds keep the tilt of a body below another, for ever.

    Args:
        loads: The loads.
        sizes: The bounds on their magnitudes, N m or N.
        tilt: The bound on the tilt from Θ = 0, rad.
        why: Why it is not decided; empty if it is proved.
        boxes: The number of boxes of the proof.
        claim: The numbers of the proof; None if it is not proved.
        start: V at the start of the config, J, computed; None if it is not proved.
        is_inside: Whether what is proved is about this start, computed.
        largest: The largest loads, if they were asked for.
        without_inputs: Whether the config has inputs, which are left out.
        record: What is claimed, with V and V', as the checker reads it; None if it is not proved.
    """

    loads: tuple[Load, ...]
    sizes: Sizes
    tilt: Fraction
    why: str = ""
    boxes: int = 0
    claim: Claim | None = None
    start: float | None = None
    is_inside: bool = False
    largest: Largest | None = None
    without_inputs: bool = False
    record: Record | None = None

    @property
    def proved(self) -> bool:
        """Whether it is proved."""
        return self.claim is not None

    @property
    def statements(self) -> list[str]:
        """Sentences, the answer first."""
        claimed = f"A{self.claimed[1:]}"
        if self.claim is None:
            return [f"{claimed}: not decided, as {self.why}.", *self._largest_sentences]
        c, level, share = self.claim, float(self.claim.level), float(self._forced)
        about = "" if self.start is None else f" T{self.about_start[1:]}."
        return [
            f"{claimed}: proved ({grouped(self.boxes)} boxes). "
            f"V = v + {decimal_text(c.cross)} p'∂T/∂ν ({DOCUMENTED}).{about}",
            f"From these starts, V(t) <= e^(-{decimal_text(c.rate)} t) V(0) + "
            f"{rounded_up((1 - share) * level)} + {rounded_up(share * level)} s² J under a "
            f"disturbance that stays below a share s of that: proved.",
            *self._largest_sentences,
        ]

    @property
    def claimed(self) -> str:
        """What is proved, or is not decided, in words without a full stop."""
        body = "this body without its inputs" if self.without_inputs else "this body"
        what = (
            f"any disturbance {names_of(self.loads, self.sizes)} keeps the tilt of {body} below "
            f"{decimal_text(self.tilt)} rad for ever"
        )
        if self.claim is None:
            return what
        level = decimal_text(self.claim.level)
        return f"{what}, from rest at Θ = 0, and from every start with less tilt and V < {level} J"

    @property
    def about_start(self) -> str:
        """Whether it is about the start of the config, in words without a full stop."""
        inside = "one of these starts" if self.is_inside else "not one of these starts"
        value = number(self.start or 0.0, LEVEL_DIGITS)
        return f"the start of this config, with V = {value} J, is {inside} (computed)"

    @property
    def _forced(self) -> Fraction:
        """The share of ℓ to which the loads may lift V: Σ βw̄²/(αℓ)."""
        assert self.claim is not None
        c = self.claim
        lifted = (b * w**2 for b, w in zip(c.weights, c.sizes, strict=True))
        return sum(lifted, Fraction(0)) / (c.rate * c.level)

    @property
    def _largest_sentences(self) -> list[str]:
        largest = self.largest
        if largest is None:
            return []
        proved = "none is proved"
        if largest.proved is not None:
            proved = f"{names_of(self.loads, largest.proved)}, proved"
        beyond = ""
        if largest.undecided is not None:
            beyond = f"; {names_of(self.loads, largest.undecided)} is not decided"
        broken = "none was found to break it"
        if largest.broken is not None:
            broken = f"{names_of(self.loads, largest.broken)} was found to break it"
        return [
            f"Largest disturbance: {proved}{beyond}. In computed motions under the worst input of "
            f"the linear system, {broken}."
        ]

    def as_data(self) -> dict[str, Any]:
        """Return all of it as plain data."""
        claim, largest = self.claim, self.largest
        points = [list(load.point) for load in self.loads if load.kind == "force"]
        return {
            "statements": self.statements,
            "proved": self.proved,
            **_by_kind(self.loads, self.sizes),
            "point": points[0] if points else None,
            "tilt": float(self.tilt),
            "level": None if claim is None else float(claim.level),
            "cross": None if claim is None else float(claim.cross),
            "rate": None if claim is None else float(claim.rate),
            "weights": _by_kind(self.loads, None if claim is None else claim.weights),
            "forced": None if claim is None else float(self._forced),
            "start": self.start,
            "start_inside": None if claim is None else self.is_inside,
            "why": self.why,
            "boxes": self.boxes,
            "largest": None
            if largest is None
            else {
                "proved": _by_kind(self.loads, largest.proved),
                "not_decided": _by_kind(self.loads, largest.undecided),
                "found_to_break": _by_kind(self.loads, largest.broken),
            },
        }


def _by_kind(loads: Sequence[Load], sizes: Sequence[Any] | None) -> dict[str, float | None]:
    """Return numbers of loads by their kinds."""
    pairs = zip(loads, sizes or (), strict=bool(sizes))
    return dict.fromkeys(UNITS, None) | {load.kind: float(size) for load, size in pairs}


def names_of(loads: Sequence[Load], sizes: Sequence[Any]) -> str:
    """Return loads as words: `couple up to 100 N m`."""
    parts = []
    for load, size in zip(loads, sizes, strict=True):
        text = decimal_text(size) if isinstance(size, Fraction) else number(size)
        at = f" at {list(load.point)} m" if load.kind == "force" else ""
        parts.append(f"{load.kind} up to {text} {UNITS[load.kind]}{at}")
    return " with any ".join(parts)
