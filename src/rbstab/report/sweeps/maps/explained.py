"""Maps of sampled members that say something: their cells differ by more than they spread."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.basins import basins_of
from rbstab.report.sweeps.maps.cell_grid import MIN_MEMBERS, MapGrid
from rbstab.report.sweeps.maps.cell_values import counted_outcome
from rbstab.report.sweeps.maps.influence import ExplainedVariance
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.proofs import proof_codes, proved_shares
from rbstab.report.sweeps.quantities import mapped, varies

MIN_EXPLAINED = 0.5
"""Cells that explain less of the variance of a quantity leave more of it inside of them.

The members of one cell then differ by more than the cells do: what the two parameters of the map
are says little of a member.
"""


def explained_by_cells(members: Members, grids: list[MapGrid]) -> dict[str, tuple[str, float]]:
    """Return the label of each map, and the share of the variance that its cells explain.

    The share is the correlation ratio of the cells with enough members; of several grids, the
    largest one counts. It is NaN if the values do not vary.
    """
    shares = {}
    for name, (label, values) in _mapped_values(members).items():
        ratios = [_explained(grid, values) for grid in grids]
        known = [ratio for ratio in ratios if np.isfinite(ratio)]
        shares[name] = label, max(known, default=float("nan"))
    return shares


def _explained(grid: MapGrid, values: Array) -> float:
    filled = (grid.counts >= MIN_MEMBERS)[grid.cells]
    return ExplainedVariance(values[grid.chosen][filled]).by(grid.cells[filled])


def _mapped_values(members: Members) -> dict[str, tuple[str, Array]]:
    """Return the label and the number of each member in each map, by the name of the map."""
    found: dict[str, tuple[str, Array]] = {}
    if np.count_nonzero(members.outcome_counts) > 1:
        label, fulfilled = counted_outcome(members)
        found["outcome"] = f"share: {label}", fulfilled.astype(float)
    if len(proof_codes(members).labels) > 1:
        found["proofs"] = "share proved", proved_shares(members)
    basins = basins_of(members)
    if basins is not None:
        found["basins"] = "share that approaches rest state 1", (basins.codes == 0).astype(float)
    for quantity in mapped(members):
        if varies(quantity.values):
            # On a logarithmic scale, colours show ratios.
            values = np.log(quantity.values) if quantity.axis.log else quantity.values
            found[quantity.name] = quantity.axis.label, values
    return found
