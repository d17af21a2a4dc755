"""Energies that begin at a plane or a sphere of angles, whose rest states are known."""

from typing import Any

from rbstab.analysis.proof.formulas.program import Program
from rbstab.analysis.proof.traced.kinked import KinkedEnergy


def plane(normal: Any, offset: float, couple: float) -> list[list[Any]]:
    """Return the operations of K (n'Θ - b)."""
    operations: list[list[Any]] = [["constant", -float(offset)]]
    total = 0
    for axis, entry in enumerate(normal):
        begin = len(operations)
        operations += [
            ["theta", axis],
            ["constant", float(entry)],
            ["*", begin, begin + 1],
            ["+", total, begin + 2],
        ]
        total = begin + 3
    return [*operations, ["constant", float(couple)], ["*", total, total + 1]]


def sphere(radius: float, couple: float) -> list[list[Any]]:
    """Return the operations of K (|Θ|² - r²)."""
    return [
        *(["theta", axis] for axis in range(3)),
        *(["**", axis, 2] for axis in range(3)),
        ["+", 3, 4],
        ["+", 6, 5],
        ["constant", float(radius * radius)],
        ["-", 7, 8],
        ["constant", float(couple)],
        ["*", 9, 10],
    ]


def kinked(operations: list[list[Any]], *, ridge: bool = False) -> KinkedEnergy:
    """Return max(h, 0) with the formula h, or min(h, 0)."""
    return KinkedEnergy("one", Program(tuple(tuple(one) for one in operations)), ridge)
