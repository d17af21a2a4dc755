"""All rest states of a config along a parameter: branches, and intervals that are proved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial

import numpy as np

from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance, entries_at
from rbstab.experiment.along.parameter import Parameter
from rbstab.experiment.robust.bodies import members_of, why_not_all
from rbstab.proof.along.branches import Branch, Branches, Turn
from rbstab.proof.along.energy import AlongEnergy, parameter_between
from rbstab.proof.along.intervals import Interval, intervals_of
from rbstab.proof.reasons import NoReducedEnergy
from rbstab.proof.rest_states import reduced_energy


@dataclass(frozen=True, eq=False)
class AlongStates:
    """The rest states in the range along a parameter.

    Args:
        branches: The curves of rest states that were found.
        turns: The folds and pitchforks on them, by the value of the parameter.
        intervals: How many rest states there are, on intervals that cover all values.
        why: Why nothing is known, or proved; "" if proofs were tried.
    """

    branches: Sequence[Branch] = ()
    turns: Sequence[Turn] = ()
    intervals: Sequence[Interval] = ()
    why: str = ""


def states_along(config: Config, parameter: Parameter, is_late: Callable[[], bool]) -> AlongStates:
    """Follow all rest states that are found at the values of a parameter, and prove intervals.

    Args:
        config: The config.
        parameter: The parameter, which the config has.
        is_late: Returns whether no further interval is to be tried.
    """
    values: list[float] = parameter.values.tolist()
    low, high = min(values), max(values)
    entries = entries_at(config, parameter.key)
    if not entries or low == high:
        return AlongStates(
            why="there is one value alone" if entries else "its numbers are in no proof"
        )
    sizes = (entry.value if parameter.scales else parameter.read.factor for entry in entries)
    start, end, *factors = (Fraction(repr(number)) for number in (low, high, *sizes))
    tolerances = [
        Tolerance(entry, size * (start + end) / 2, abs(size) * (end - start) / 2)
        for entry, size in zip(entries, factors, strict=True)
    ]
    why = why_not_all(config, tolerances)
    members = members_of(config, tolerances)

    def between(low: float, high: float) -> AlongEnergy:
        numbers = [parameter_between(low, high).scaled(size) for size in factors]
        return AlongEnergy(reduced_energy(system, partial(members.exact, numbers)), low, high)

    try:
        system = members.from_doubles([float(tolerance.middle) for tolerance in tolerances])
        energy = between(low, high)
    except (NoReducedEnergy, LookupError) as error:  # code of users has no numbers that vary
        return AlongStates(why=why or str(error))
    branches = Branches(energy)
    with np.errstate(all="ignore"):
        for value in values:
            branches.search(value)
        # Variables z are counted from where U is least in the middle: bounds are far sharper there.
        again = between if energy.free else None
        intervals = intervals_of(branches, lambda: bool(why) or is_late(), again)
    turns = sorted(branches.turns.values(), key=lambda turn: turn.value)
    return AlongStates(branches.curves, turns, intervals, why)
