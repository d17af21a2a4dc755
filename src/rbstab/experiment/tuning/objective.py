"""What a config can be tuned for."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rbstab.analysis.sensitivity import Outcome


class Objective(NamedTuple):
    """A number of a run that is to be small: its name, symbol, unit and meaning."""

    name: str
    symbol: str
    unit: str
    meaning: str

    def of(self, outcome: "Outcome") -> float:
        """The number in an outcome; or its derivative in the derivative of an outcome."""
        fields = {
            "settling_time": outcome.settling_time,
            # The distance |E|, not its largest component: it is smooth wherever one peak in time is
            # the highest, while a largest component also changes where two axes change places.
            "peak_displacement": outcome.largest_distance,
            "energy": outcome.lyapunov_integral,
        }
        return float(fields[self.name])


OBJECTIVES = {
    objective.name: objective
    for objective in (
        Objective("settling_time", "t_s", "s", "when v falls below v(0)/1000 for good"),
        Objective("peak_displacement", "max|E|", "m", "the largest distance of C from its anchor"),
        Objective("energy", "∫v dt", "J s", "the Lyapunov function integrated over the run"),
    )
}
