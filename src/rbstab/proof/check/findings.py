"""The results of checking a proof."""

from collections.abc import Mapping
from typing import NamedTuple

Box = tuple[tuple[float, float], ...]
"""The lower and the upper end of each variable."""

IN_RANGE = "the range of eq. 5"
EVERYWHERE = "all θ1 and θ3"

TIME = "time"
"""The claim of a finding that the check takes too long: then the proof is not refused."""


VERSION = "version"
"""The claim of a finding that this checker does not know claims of this version."""

CONVEXITY = "convexity"
"""The claim that U is convex in what is not Θ. The rules that show it know few functions, so the
proof is not refused where they fail."""


class Cover(NamedTuple):
    """A cover of a box by smaller boxes, each with the reason why it is settled.

    Attributes:
        box: The box.
        tree: The boxes in the order of a walk: the axis ("1" to "3") along which a box is halved
            at its middle, followed by its lower and its upper half; or the reason of a settled box.
        boxes: The number of boxes that were examined.
        open: A box that could not be settled; None if all are settled, so that the cover is proved.
        places: Boxes to which reasons refer, by their names.
    """

    box: Box
    tree: list[str]
    boxes: int
    open: Box | None
    places: Mapping[str, Box] = {}


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
        return sum(cover.boxes for cover in self.covers.values())


def shown(box: Box) -> str:
    """Return a box as text."""
    return ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in box)


def confirmed(
    about: str, claim: str, text: str, covers: Mapping[str, Cover], *, verified: bool = True
) -> Finding:
    """Return a finding that is verified if its covers have no open box, and in words if not.

    Args:
        about: The name of the range of Θ.
        claim: The name of the claim.
        text: What was checked: a sentence without its full stop.
        covers: The covers, by the name of the place that they cover.
        verified: Whether all else is verified.
    """
    verified = verified and all(cover.open is None for cover in covers.values())
    text = f"{text}." if verified else f"{text}: this could not be confirmed."
    return Finding(about, claim, verified, text, covers)


class RefusedError(ValueError):
    """A record that is no proof: it cannot be read, or claims what no proof can."""


class TooLongError(Exception):
    """The check takes too long."""
