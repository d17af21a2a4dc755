"""The check that no part adds energy to the motion."""

import numpy as np

from rbstab.analysis.certificate.evidence import (
    ROUND_OFF,
    Evidence,
    Finding,
    confirmed,
    repeated,
)
from rbstab.analysis.certificate.verdict import Check, verdict_of
from rbstab.analysis.exact import exact_dissipation, in_balls
from rbstab.mechanics.numbers import Array

EIGENVALUE_ERROR = 1e-15
"""Error of a computed eigenvalue, relative to the largest entry of its matrix."""


def damping(run: Evidence) -> Check:
    """Check that no damping matrix has a negative eigenvalue, and that no part adds energy.

    The second test does not use the declarations of gains. So it also finds an element that adds
    energy to the motion but declares no dissipating gain.
    """
    adding = _adding_energy(run)
    if adding is not None:
        return adding
    matrices = [
        getattr(element, gain.name)
        for element in run.systems[0].elements
        for gain in element.gains
        if gain.dissipates
    ]
    value = min(map(_smallest_eigenvalue, matrices), default=0.0)
    quantity = "smallest eigenvalue of the damping matrices"
    return Check("damping", verdict_of(value >= 0), value, 0.0, np.nan, quantity)


def _smallest_eigenvalue(L: Array) -> float:
    """Return the smallest eigenvalue of a damping matrix; one that is 0 to round-off is 0."""
    smallest = float(np.linalg.eigvalsh(0.5 * (L + L.T))[0])
    return 0.0 if abs(smallest) <= EIGENVALUE_ERROR * float(np.abs(L).max()) else smallest


def _adding_energy(run: Evidence) -> Check | None:
    """Return a check that is not consistent if a part adds energy, else None."""
    # Ignore the non-finite values at the end of a diverged run.
    dissipation = np.where(np.isfinite(run.dissipation), run.dissipation, 0.0)
    least, parts = dissipation.min(axis=1), dissipation.argmin(axis=1)
    rows = np.flatnonzero(least < -ROUND_OFF * float(np.abs(dissipation).max()))

    if not len(rows):
        return None

    def repeat(row: int) -> Finding:
        system, y, part = run.systems[row], run.states[row], int(parts[row])
        t = float(run.times[row])
        power = in_balls(lambda: exact_dissipation(system, y, part, t))
        return Finding(confirmed(power is not None and power < 0), float(least[row]), row)

    verdict, value, row = repeated(repeat, rows[least[rows].argsort(kind="stable")])
    quantity = f"power dissipated by {run.systems[row].parts[int(parts[row])]}, W"
    return Check("damping", verdict, value, 0.0, float(run.times[row]), quantity)
