"""Motions of runs: arrays with the dimensions run, time and axis, in memory and in their files."""

import numpy as np

from rbstab.store.dataset import Dataset
from rbstab.store.variables import RUN

MOTIONS = "a file of traces of a sweep"
"""The kind of the files."""


class Motions(Dataset):
    """The trajectories of one or several runs at common times, as arrays by name.

    An array has the shape (time,) or (time, 3); with several runs, (run, time) or (run, time, 3).
    The arrays are read-only.

    Attributes:
        variables: Arrays by name, with dimensions and SI units, including the coordinates `time`,
            s, `axis` and `run`.
        attributes: Metadata: texts and numbers.
    """

    def _facts(self) -> list[str]:
        """Return how many runs, if several, samples and arrays there are."""
        several = RUN in self and self.variables[RUN].dimensions == (RUN,)
        return [*([f"{len(self[RUN])} runs"] if several else []), *super()._facts()]


def stack_motions(runs: list[Motions]) -> Motions:
    """Join the motions of single runs along the dimension `run`; their times must be equal."""
    stacked = {}
    for name, variable in runs[0].variables.items():
        if name == RUN:
            stacked[name] = variable._replace(
                dimensions=(RUN,), data=np.stack([m[RUN] for m in runs])
            )
        elif variable.dimensions == (name,):
            stacked[name] = variable
        elif all(name in run for run in runs):
            data = np.stack([run[name] for run in runs])
            stacked[name] = variable._replace(dimensions=(RUN, *variable.dimensions), data=data)
    return Motions(stacked, runs[0].attributes)
