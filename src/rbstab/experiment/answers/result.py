"""The result of a run, with what follows from its arrays: the class that users have."""

from rbstab.experiment.summary import settling_time_of
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

    @property
    def settling_time(self) -> float:
        """The time from which v stays below v(0)/1000, s; NaN if the run has not settled."""
        return settling_time_of(self)
