"""Plans of many members, and a fast engine that makes up their results."""

import time

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.sweep.members.engine import Shard, columns_of_failed
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.load import load_plan
from support.configs import VISCO_ELASTIC, plain

SHORT = {"duration": 0.02, "samples": 5, "rtol": 1e-6}


def plan_of(members=60, **changes):
    """Return a plan whose initial spin varies along a grid."""
    spin = {"linspace": [-40, 40, members]}
    data = {"title": "Fake", "base": plain(VISCO_ELASTIC)}
    return load_plan({**data, "vary": {"initial.angular_velocity[0]": spin}, **changes})


def plan_with_traces(members=60, keep="traces", **changes):
    """Return the same plan with five samples, stored as traces."""
    base = {**plain(VISCO_ELASTIC), "integration": SHORT}
    return plan_of(members, **{"keep": keep, "base": base, **changes})


class FakeEngine:
    """An engine whose made up numbers depend on the values of a member alone.

    Args:
        plan: The plan.
        delay: The time that a member takes, s.
        failing: Members that diverge.
        raising: Members at which the engine raises an unexpected error.
    """

    def __init__(self, plan, delay=0.0, failing=(), raising=()):
        self.plan = plan
        self.delay = delay
        self.failing = failing
        self.raising = raising

    def compute(self, start, stop):
        time.sleep(self.delay * (stop - start))
        if any(start <= member < stop for member in self.raising):
            raise ZeroDivisionError("made up")
        outcome = columns_of_failed(stop - start)
        spin = self.plan.values(start, stop)["initial.angular_velocity[0]"]
        for k, (name, column) in enumerate(COLUMNS.items()):
            if column.dtype == "f8":
                outcome[name][:] = np.sin((k + 1) * spin).reshape(-1, *[1] * len(column.shape))
        outcome["status"][:] = STATUSES.index(RunStatus.COMPLETED)
        for member in self.failing:
            if start <= member < stop:
                outcome["status"][member - start] = STATUSES.index(RunStatus.DIVERGED)
        return Shard(outcome, self._traces(start, stop, spin))

    def _traces(self, start, stop, spin):
        chosen = self.plan.keep.selected(start, stop)
        if not chosen.any():
            return None
        layout = layout_of(self.plan)
        traces = layout.empty(int(chosen.sum()))
        for k, name in enumerate(layout.quantities):
            along = np.sin((k + 1) * spin[chosen, np.newaxis] + layout.times)
            traces[name][:] = along if traces[name].ndim == 2 else along[..., np.newaxis]
        return traces


def shard_files(folder, of="shards"):
    """Return the content of the shards of a folder, or of their traces, by file name."""
    return {path.name: path.read_bytes() for path in sorted((folder / of).glob("[0-9]*"))}
