"""Objectives of a tuning."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rbstab.analysis.sensitivity import Outcome


class Objective(NamedTuple):
    """A number that a tuning minimizes: its name, symbol, unit and meaning."""

    name: str
    symbol: str
    unit: str
    meaning: str

    def of(self, outcome: "Outcome") -> float:
        """Return the number from an outcome, or its derivative from an outcome's derivative."""
        fields = {
            "settling_time": outcome.settling_time,
            # The largest distance |E| has kinks only where another peak in time becomes the
            # highest. The largest component has more: where another axis becomes the largest.
            "peak_displacement": outcome.largest_distance,
            "energy": outcome.lyapunov_integral,
        }
        return float(fields[self.name])


OBJECTIVES = {
    objective.name: objective
    for objective in (
        Objective("settling_time", "t_s", "s", "the time after which v stays below v(0)/1000"),
        Objective("peak_displacement", "max|E|", "m", "the largest distance of C from its anchor"),
        Objective("energy", "∫v dt", "J s", "the Lyapunov function integrated over the run"),
    )
}
