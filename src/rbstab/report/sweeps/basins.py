"""The members of a sweep, grouped by the rest state that they approach."""

from dataclasses import dataclass

import numpy as np

from rbstab.experiment.answers.rounded import vector
from rbstab.mechanics.attitude import rotations
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import turned_back
from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.sweeps.members import Members, kept

SAME_ANGLES = 0.02
"""rad: rest states whose angles differ by less count as one."""

MAX_STATES = 8
"""With more distinct rest states there is no table: they probably vary with the parameters."""


@dataclass(frozen=True, eq=False)
class Basins:
    """The distinct rest states that completed members approach, lowest first.

    Args:
        energies: The stored energy of each, J.
        orientations: Θ of each, shape (states, 3), rad.
        codes: The number of each member's state, from 0; -1 if it did not complete; shape (n,).
    """

    energies: Array
    orientations: Array
    codes: Array


@kept
@np.errstate(all="ignore")  # a foreign file may have any numbers
def basins_of(members: Members) -> Basins | None:
    """Return the basins of a sweep; None unless its members approach 2 to `MAX_STATES` states.

    Members have the same rest states only if they differ in their starts alone.
    """
    if not members.share_rest_states or "rest_orientation" not in members.table:
        return None
    Theta, energy = members.column("rest_orientation"), members.column("energy_at_rest")
    has_state = members.completed & np.isfinite(Theta).all(axis=1) & np.isfinite(energy)
    codes = np.full(len(has_state), -1)
    # In quaternions a rest state has many angles; elsewhere other turns may be another state.
    in_quaternions = members.plan is not None and members.plan.in_quaternions
    places = rotations(Theta) if in_quaternions else Theta[:, np.newaxis]
    representatives: list[int] = []
    left = has_state.copy()
    while left.any():
        first = int(np.flatnonzero(left)[0])
        same = left & (np.abs(places - places[first]).max(axis=(1, 2)) < SAME_ANGLES)
        codes[same] = len(representatives)
        representatives.append(first)
        left &= ~same
        if len(representatives) > MAX_STATES:
            return None
    if len(representatives) < 2:
        return None
    order = np.argsort(energy[representatives], kind="stable")
    rank = np.argsort(order)
    chosen = np.array(representatives)[order]
    numbers = np.where(codes < 0, -1, rank[codes])
    orientations = Theta[chosen]
    if in_quaternions:
        orientations = np.array([turned_back(orientation) for orientation in orientations])
    return Basins(energy[chosen], orientations, numbers)


def basin_blocks(name: str, members: Members) -> list[Block]:
    """Return a table of the rest states that members approach, if there are several."""
    basins = basins_of(members)
    if basins is None:
        return []
    heads = "rest state", "members", Head("energy", "J"), Head("Θ", "rad")
    counts = np.bincount(basins.codes[basins.codes >= 0], minlength=len(basins.energies)).tolist()
    # Angles below a nanoradian are only round-off.
    angles = map(vector, np.round(basins.orientations, 9) + 0.0)
    energies = (Cell.number(energy, 6) for energy in basins.energies.tolist())
    names = (str(k + 1) for k in range(len(counts)))
    rows = zip(names, counts, energies, angles, strict=True)
    note = (
        "The lowest first. v of a member counts from the rest state that it approaches: the end of "
        "a descent in energy from its last sample. Members for which none was found are left out."
    )
    return [Table.of(f"{name}-basins", "Rest states that members approach", heads, rows, note)]
