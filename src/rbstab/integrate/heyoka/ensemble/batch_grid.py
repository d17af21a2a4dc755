"""The samples of a batch, in a form that heyoka reads fast."""

from typing import Self

import numpy as np

from rbstab.mechanics.numbers import Array


class BatchGrid(np.ndarray):
    """The samples of all lanes of a batch, shape (n, batch), s; the same for each lane.

    heyoka calls `flatten` in each integration, and converts the entries one by one. Those of a list
    are Python numbers already; those of an array become Python objects first, which takes a fifth
    of the time of an integration.
    """

    entries: list[float]
    """All entries, row by row."""

    @classmethod
    def of(cls, times: Array, batch: int) -> Self:
        """Return the grid of some samples, shape (n,), s."""
        grid = np.repeat(times[:, np.newaxis], batch, axis=1).view(cls)
        grid.entries = grid.ravel().tolist()
        return grid

    def flatten(self, *_: object) -> list[float]:  # type: ignore[override]
        """Return all entries, row by row. numpy would return an array, which heyoka accepts too."""
        return self.entries
