"""Boxes of Θ, with ends that are doubles."""

from collections.abc import Sequence

Box = tuple[tuple[float, float], ...]
"""The ends of θ1, θ2 and θ3, rad."""

AXES = range(3)


def box_between(corners: Sequence[Sequence[float]]) -> Box:
    """Return the box between its lower and its upper corner."""
    return tuple((low, high) for low, high in zip(*corners, strict=True))


def flat(box: Box, axis: int) -> Box:
    """Return a box without its extent along an axis, for a face whose place is given elsewhere."""
    return (*box[:axis], (0.0, 0.0), *box[axis + 1 :])


def width(box: Box) -> float:
    """Return the largest width of a box."""
    return max(high - low for low, high in box)


def halves(box: Box, stretch: float = 1.0) -> tuple[int, Box, Box]:
    """Return the axis along which a box is widest, and its lower and upper half.

    Args:
        box: The box.
        stretch: The width along θ2 counts so many times.
    """
    widths = [
        (high - low) * (stretch if axis == 1 else 1.0) for axis, (low, high) in enumerate(box)
    ]
    _, axis = max(zip(widths, range(len(widths)), strict=True))
    low, high = box[axis]
    middle = low / 2 + high / 2
    before, after = box[:axis], box[axis + 1 :]
    return axis, (*before, (low, middle), *after), (*before, (middle, high), *after)


def within(box: Box, other: Box) -> bool:
    """Return whether a box is part of another one."""
    return all(other[i][0] <= box[i][0] and box[i][1] <= other[i][1] for i in AXES)


def gap(box: Box, other: Box) -> float:
    """Return the largest distance of two boxes along an axis; 0 if they have a common point."""
    return max(0.0, *(max(other[i][0] - box[i][1], box[i][0] - other[i][1]) for i in AXES))


def touches(box: Box, other: Box) -> bool:
    """Return whether two boxes have a common point. Boxes have their ends."""
    for (low, high), (other_low, other_high) in zip(box, other, strict=True):
        if low > other_high or other_low > high:
            return False
    return True


def shown(box: Box) -> str:
    """Return a box as text."""
    return " x ".join(f"[{low:.9g}, {high:.9g}]" for low, high in box)
