"""The result of a run, with what follows from its arrays: the class that users have."""

from rbstab.experiment.answers.outcome import Outcome, outcome_of
from rbstab.experiment.stored_run import stored_config
from rbstab.experiment.summary import settling_time_of
from rbstab.mechanics.attitude import quaternions, rotations
from rbstab.mechanics.numbers import Array
from rbstab.store import result


class Result(result.Result):
    """The result of one run: arrays by name, such as `result["orientation"]`, all in SI units.

    A scalar quantity has the shape (time,), a vector (time, 3). The arrays are read-only: copy one
    to change it.

    Attributes:
        variables: Arrays by name, with dimensions, unit and meaning. An array named like a
            dimension is its coordinate. The name of an array in a group starts with the name of the
            group: `certificate/verdict`.
        attributes: Metadata: texts and numbers (`status`, `run_id`, ...).
        config: The resolved config, YAML, with all defaults.
    """

    def _facts(self) -> list[str]:
        """Return the outcome, and then what each result shows of itself."""
        return [f"outcome {self.outcome.brief}: {self.outcome.sureness}", *super()._facts()]

    @property
    def rotation(self) -> Array:
        """A(Θ) of each sample, from body to inertial coordinates (eq. 2), shape (time, 3, 3)."""
        return rotations(self["orientation"])

    @property
    def quaternion(self) -> Array:
        """The same rotations as unit quaternions w, x, y, z, shape (time, 4); no sign jumps."""
        return quaternions(self.rotation)

    @property
    def outcome(self) -> Outcome:
        """Where the body rests, how far from the desired attitude of the config, and how surely."""
        return outcome_of(self, stored_config(self).config)

    @property
    def settling_time(self) -> float:
        """The time from which v stays below v(0)/1000, s; NaN if the run has not settled."""
        return settling_time_of(self)
