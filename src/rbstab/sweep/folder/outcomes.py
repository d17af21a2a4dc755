"""The outcomes of the members of a sweep, computed when its table is read."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.config.build import supplies_power
from rbstab.config.elements import SIGNAL
from rbstab.config.errors import ConfigError
from rbstab.config.schema import Config
from rbstab.config.source import parse_source
from rbstab.experiment.answers.outcome import KIND_OF_STATUS, KINDS, OutcomeKind, outcome_codes
from rbstab.experiment.answers.run_answer import SETTLED, SETTLED_DRIVEN
from rbstab.experiment.answers.wanted import Wanted, wanted
from rbstab.files.text import grouped
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.attitude import tilt
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Column, Table
from rbstab.store.variables import RUN
from rbstab.sweep.folder.deciding import deciding_sentence, end_of
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.load import plan_to_read
from rbstab.sweep.plan.plan import Plan

READ = (
    *("status", "settling_time", "end_time"),
    *("rest_orientation", "rest_unstable", "final_orientation"),
)
"""The columns from which the outcomes follow."""

SPEEDS = ("final_angular_velocity", "final_velocity")
"""Those that tell whether a member stands still where v does not (`stand_still`)."""

STILL = 1e-4
"""rad/s and m/s: a body that is slower at the end of its run stands still."""

STEADY = {"constant", "pulse", "ramp", "table"}
"""The signals that do not change for ever."""

OUTCOME_COLUMNS = {
    "outcome": Column((), "i1", "1", "what became of the member", tuple(map(str, KINDS))),
    "final_tilt": Column(
        (), "f8", "rad", "angle from the desired attitude: at rest, or else at the end of the run"
    ),
    "rest_state": Column(
        (),
        "i4",
        "1",
        "number of the pose at which the member rests, by its tilt; members with one number rest "
        "at one pose; 0: it does not rest; -1: one of too many poses",
    ),
}
"""The columns that no file has: they depend on what is wanted of the body."""

MAX_POSES = 1000
"""The most poses that are numbered."""

_BLOCK = 1 << 20
"""Members whose rotation matrices are in memory at once."""

_STATUS_CODES = np.array([KINDS.index(KIND_OF_STATUS[status]) for status in STATUSES], np.int8)


def plan_of(table: Table) -> Plan | None:
    """Return the plan that is stored in the table of a sweep; None if it cannot be read."""
    try:
        plan = plan_to_read(parse_source(str(table["plan"]), "plan").data)
    except (ConfigError, KeyError):
        return None
    return plan if plan.members == len(table[RUN]) else None


def wanted_of(plan: Plan | None) -> Wanted:
    """Return what is wanted of the bodies of a plan; its variants share it."""
    return wanted(None if plan is None else next(iter(plan.bases.values())))


def with_outcomes(table: Table, plan: Plan | None) -> Table:
    """Return the table of a sweep with `OUTCOME_COLUMNS` after those of its varied values.

    Args:
        table: The table, with the columns in `READ`.
        plan: Its plan, which says what is wanted; None: the default.
    """
    end = table["final_orientation"]
    rest = table["rest_orientation"]
    settled = np.isfinite(table["settling_time"])
    completed = table["status"] == STATUSES.index(RunStatus.COMPLETED)
    at_rest = completed & (settled | stand_still(table, plan))
    aim = wanted_of(plan)
    desired = np.array(aim.orientation)
    # What is no number has no tilt; a foreign file may have any numbers.
    with np.errstate(all="ignore"):
        poses = np.where(settled[:, np.newaxis], rest, end)
        tilts = _tilts(np.where(at_rest[:, np.newaxis], poses, end), desired)
    # A sweep of an earlier version has no such column.
    unstable = settled & (table["rest_unstable"] > 0 if "rest_unstable" in table else False)
    data = {
        "outcome": outcome_codes(
            _STATUS_CODES[table["status"]], at_rest, tilts, aim.within, unstable
        ),
        "final_tilt": tilts,
        "rest_state": pose_numbers(poses, tilts, at_rest),
    }
    outcomes = {name: column.of(data[name]) for name, column in OUTCOME_COLUMNS.items()}
    first = {name: table.variables[name] for name in (RUN, *table.varied) if name in table}
    return replace(table, variables=first | outcomes | dict(table.variables))


def stand_still(table: Table, plan: Plan | None) -> Array:
    """Return which members stand still at the end, where v does not tell it.

    Inputs that have become steady may hold them; or no rest state was found, as at θ2 = ±90°.

    Args:
        table: The table, with the columns in `READ` and `SPEEDS`.
        plan: Its plan.
    """
    bases = () if plan is None else plan.bases.values()
    if any(map(supplies_power, bases)):
        asked = np.full(len(table["status"]), all(map(_is_steady, bases)))
    else:
        asked = np.isnan(table["rest_orientation"]).any(axis=1)
    if not asked.any():
        return asked
    still: Array = np.all([np.abs(table[name]).max(axis=1) < STILL for name in SPEEDS], axis=0)
    return asked & still


def _is_steady(base: Config) -> bool:
    """Return whether all signals of a config are constant from some time on."""
    driven = (element for element in base.elements.values() if hasattr(element, SIGNAL))
    return all(element.signal.kind in STEADY for element in driven)


def _tilts(orientations: Array, desired: Array) -> Array:
    """Return the tilts of attitudes, in blocks: their rotation matrices need much memory."""
    parts = range(0, max(len(orientations), 1), _BLOCK)
    return np.concatenate([tilt(orientations[k : k + _BLOCK], desired) for k in parts])


def pose_numbers(orientations: Array, tilts: Array, chosen: Array) -> Array:
    """Return numbers of poses, by tilt from 1; poses closer than `SAME_STATE` have one number.

    Args:
        orientations: Θ, shape (m, 3), rad.
        tilts: The tilt of each, shape (m,), rad: all from one attitude.
        chosen: The members whose poses are numbered, shape (m,); the others have 0.

    Returns:
        The numbers, shape (m,); -1 for poses after the first `MAX_POSES`.
    """
    numbers = np.zeros(len(tilts), np.int32)
    left = np.flatnonzero(chosen & np.isfinite(tilts))
    left = left[np.argsort(tilts[left], kind="stable")]
    numbers[left] = -1
    for number in range(1, MAX_POSES + 1):
        if not len(left):
            break
        # By the triangle inequality, the poses next to the first one have no larger tilt.
        ahead = int(np.searchsorted(tilts[left], tilts[left[0]] + SAME_STATE, side="right"))
        near = left[:ahead]
        same = _tilts(orientations[near], orientations[left[0]]) < SAME_STATE
        same[0] = True
        numbers[near[same]] = number
        left = np.concatenate([near[~same], left[ahead:]])
    return numbers


class SweepOutcomes(NamedTuple):
    """What became of the members of a sweep.

    Attributes:
        counts: The number of members with each kind of outcome; kinds that do not occur have 0.
        proved: How many of those that return are proved to converge to a rest state.
        moving_proved: How many of those that are still moving are proved to converge to one.
        poses: The number of distinct poses at which members rest; None if there are too many.
        end: When their runs end, as text.
        aim: What is wanted of the bodies.
        deciding: From which value of one parameter on they return; "" if none decides.
        at_rest: What "at rest" means for their runs.
    """

    counts: dict[OutcomeKind, int]
    proved: int
    moving_proved: int
    poses: int | None
    end: str
    aim: Wanted
    deciding: str
    at_rest: str = SETTLED

    @property
    def all_return(self) -> bool:
        """Whether all members return."""
        return sum(self.counts.values()) == self.counts[OutcomeKind.RETURNS]

    @property
    def brief(self) -> str:
        """How many members return, for a list of sweeps."""
        returns = self.counts[OutcomeKind.RETURNS]
        return f"{grouped(returns)} of {grouped(sum(self.counts.values()))} return"

    @property
    def parts(self) -> list[str]:
        """The counts as texts, that of the members that return first."""
        members = grouped(sum(self.counts.values()))
        returns, *others = self.counts.items()
        sure = f", {grouped(self.proved)} of them proved" if self.proved else ""
        texts = [f"{returns[0].words}: {grouped(returns[1])} of {members} members{sure}"]
        for kind, count in others:
            at, later = "", ""
            if kind is OutcomeKind.MOVING:
                at = f" at {self.end}"
                if self.moving_proved:
                    later = f", {grouped(self.moving_proved)} of them proved to come to rest later"
            texts += [f"{kind.words}{at}: {grouped(count)}{later}"] if count else []
        return texts

    @property
    def sentence(self) -> str:
        """The counts as a sentence, without a full stop."""
        return "; ".join(self.parts)

    @property
    def data(self) -> dict[str, Any]:
        """The same as data for JSON."""
        return {
            "outcomes": {str(kind): count for kind, count in self.counts.items()},
            "returns_proved": self.proved,
            "moving_proved": self.moving_proved,
            "rest_states": self.poses,
            "deciding": self.deciding or None,
        }


def outcomes_of(table: Table, plan: Plan | None, proved: Array) -> SweepOutcomes:
    """Return what became of the members of a sweep.

    Args:
        table: Its table, with the outcomes and the columns of the varied keys.
        plan: Its plan; None if it cannot be read.
        proved: Which members are proved to converge to a rest state, shape (members,).
    """
    counts = np.bincount(table["outcome"], minlength=len(KINDS)).tolist()
    returns = table["outcome"] == KINDS.index(OutcomeKind.RETURNS)
    moving = table["outcome"] == KINDS.index(OutcomeKind.MOVING)
    numbers = table["rest_state"]
    driven = plan is not None and any(map(supplies_power, plan.bases.values()))
    return SweepOutcomes(
        counts=dict(zip(KINDS, counts, strict=True)),
        proved=int(np.count_nonzero(returns & proved)),
        moving_proved=int(np.count_nonzero(moving & proved)),
        poses=None if (numbers < 0).any() else int(numbers.max(initial=0)),
        end=end_of(table),
        aim=wanted_of(plan),
        deciding="" if plan is None else deciding_sentence(plan, table),
        at_rest=SETTLED_DRIVEN if driven else SETTLED,
    )
