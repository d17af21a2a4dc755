"""All rest states of a config along a parameter: branches, and intervals that are proved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance, entries_at
from rbstab.experiment.along.parameter import Parameter
from rbstab.experiment.robust.bodies import CODE_VARIES, members_of, why_not_all

if TYPE_CHECKING:
    from rbstab.proof.along.branches import Branch, Turn
    from rbstab.proof.along.intervals import Interval

ONE_VALUE = "there is only one value"

NOT_IN_PROOFS = "its numbers are in no proof"


@dataclass(frozen=True, eq=False)
class AlongStates:
    """The rest states in the range along a parameter.

    Args:
        branches: The curves of rest states that were found.
        turns: The folds and pitchforks on them, by the value of the parameter.
        intervals: How many rest states there are, on intervals that cover all values.
        why: Why nothing is known, or proved; "" if proofs were tried.
    """

    branches: "Sequence[Branch]" = ()
    turns: "Sequence[Turn]" = ()
    intervals: "Sequence[Interval]" = ()
    why: str = ""


def states_along(
    config: Config, parameter: Parameter, is_late: Callable[[], bool] | None
) -> AlongStates:
    """Follow all rest states that are found at the values of a parameter, and prove intervals.

    Args:
        config: The config.
        parameter: The parameter, which the config has.
        is_late: Returns whether no further interval is to be tried; None to prove nothing.
    """
    # Imported late: few commands make proofs.
    from rbstab.proof.along.branches import Branches
    from rbstab.proof.along.energy import AlongEnergy
    from rbstab.proof.along.intervals import intervals_of
    from rbstab.proof.exact.expr import variable
    from rbstab.proof.reasons import NoReducedEnergy
    from rbstab.proof.rest_states import reduced_energy
    from rbstab.proof.robust.numbers import FIRST

    low, high = float(parameter.values.min()), float(parameter.values.max())
    entries = entries_at(config, parameter.key)
    if not entries or low == high:
        return AlongStates(why=NOT_IN_PROOFS if low < high else ONE_VALUE)
    given = [one.value if parameter.scales else parameter.read.factor for one in entries]
    factors: list[Fraction] = decimals(np.array(given)).tolist()
    ends = [Fraction(repr(low)), Fraction(repr(high))]
    tolerances = [
        Tolerance(one, size * (ends[0] + ends[1]) / 2, abs(size) * (ends[1] - ends[0]) / 2)
        for one, size in zip(entries, factors, strict=True)
    ]
    why = why_not_all(config, tolerances)
    if why == CODE_VARIES:
        return AlongStates(why=why)
    members = members_of(config, tolerances)
    numbers: list[Any] = [variable(FIRST).scaled(size) for size in factors]
    middle = [float(one.middle) for one in tolerances]
    try:
        U = reduced_energy(members.own(middle), partial(members.exact, numbers))
        energy = AlongEnergy(U, low, high)
    except NoReducedEnergy as error:
        return AlongStates(why=str(error))
    branches = Branches(energy)
    with np.errstate(all="ignore"):
        for value in parameter.values.tolist():
            branches.search(value)
        intervals = intervals_of(branches, None if why else is_late)
    turns = sorted(branches.turns, key=lambda turn: turn.value)
    return AlongStates(branches.curves, turns, intervals, why)
