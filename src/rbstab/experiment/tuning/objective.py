"""Objectives of a tuning."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rbstab.analysis.sensitivity import Outcome


class Objective(NamedTuple):
    """A number that a tuning minimizes.

    Attributes:
        name: Its name.
        symbol: Its symbol.
        unit: Its unit.
        meaning: What it is, in words.
        field: The field of an `Outcome` that holds it.
    """

    name: str
    symbol: str
    unit: str
    meaning: str
    field: str

    def of(self, outcome: "Outcome") -> float:
        """Return the number from an outcome, or its derivative from an outcome's derivative."""
        return float(getattr(outcome, self.field))


OBJECTIVES = {
    objective.name: objective
    for objective in (
        Objective(
            "settling_time",
            "t_s",
            "s",
            "the time after which v stays below v(0)/1000",
            "settling_time",
        ),
        # The largest distance |E| has kinks only where another peak in time becomes the highest.
        # The largest component has more: where another axis becomes the largest.
        Objective(
            "peak_displacement",
            "peak |E|",
            "m",
            "the largest distance of C from its anchor",
            "largest_distance",
        ),
        Objective(
            "energy",
            "∫v dt",
            "J s",
            "the Lyapunov function integrated over the run",
            "lyapunov_integral",
        ),
    )
}
