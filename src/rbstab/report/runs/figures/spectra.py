"""Eigenvalues of runs that are compared: which runs have the same, and which are far away."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.mechanics.numbers import Array
from rbstab.report.model.words import listed
from rbstab.report.reading.sources import Run

SAME = 1e-6
"""Eigenvalues that differ by this share of their size are drawn in the same place."""

ROUND_OFF = 1e-12
"""The error of an eigenvalue, as a share of the largest one."""

FAR = 10.0
"""Eigenvalues are far away if they are so many times as large as the next smaller one."""

MOST_FAR = 0.25
"""Only so large a share of all eigenvalues is far away; the figure is about the others."""


class Roots(NamedTuple):
    """Eigenvalues of a run: factors on K_r, shape (n,); values, complex, shape (n, k), 1/s."""

    run: Run
    factors: Array
    values: Array


def alike(spectra: Sequence[Roots]) -> list[tuple[Roots, str]]:
    """Return one of the runs with the same eigenvalues for all of them, with their labels.

    Args:
        spectra: The eigenvalues of each run, of one factor.
    """
    groups: list[list[Roots]] = []
    for roots in spectra:
        same = (group for group in groups if _are_same(group[0].values[0], roots.values[0]))
        group = next(same, None)
        if group is None:
            groups.append([roots])
        else:
            group.append(roots)
    return [(group[0], listed(roots.run.label for roots in group)) for group in groups]


def _are_same(one: Array, other: Array) -> bool:
    if one.shape != other.shape:
        return False
    if np.count_nonzero(one.real > 0) != np.count_nonzero(other.real > 0):
        return False
    distances = np.abs(one[:, np.newaxis] - other)
    error = ROUND_OFF * np.abs(one).max(initial=0.0)
    return all(
        bool((distances.min(axis=axis, initial=np.inf) <= SAME * np.abs(own) + error).all())
        for axis, own in ((1, one), (0, other))
    )


def farthest(spectra: Sequence[Array]) -> float:
    """Return the size from which on eigenvalues are far away from all others; inf if none is.

    Of each run, some eigenvalue is near.
    """
    sizes = np.sort(np.abs(np.concatenate([values.ravel() for values in spectra])))
    first = int(np.ceil((1 - MOST_FAR) * len(sizes)))
    for before, size in zip(sizes[max(first - 1, 0) :], sizes[first:], strict=False):
        if before > 0 and size > FAR * before:
            far = float(size)
            return far if all((~is_far(values, far)).any() for values in spectra) else np.inf
    return np.inf


def is_far(values: Array, far: float) -> NDArray[np.bool_]:
    """Return which eigenvalues are left out of a figure: never those that do not decay."""
    return np.asarray((np.abs(values) >= far) & (values.real < 0))
