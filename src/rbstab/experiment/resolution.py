"""Warnings about a run: its range, and lost digits of small quantities and inverses."""

import math
from typing import Any

import numpy as np

from rbstab.integrate.problem import Trajectory
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.algebra import inverse
from rbstab.store.variables import Variable
from rbstab.systems.parameters import parameters
from rbstab.systems.system import System

CHECKED = ("orientation", "angular_velocity", "position", "velocity")

LARGEST_SHARE = 1e-8
"""The largest error of a step without a warning, relative to the largest value of a quantity."""

LARGEST_INVERSE_ERROR = 1e-9
"""The largest error of the inverse of a matrix that needs no warning, relative to the matrix."""


def motion_warnings(trajectory: Trajectory, *, reads_angles: bool) -> list[str]:
    """Return warnings about a motion.

    θ1 or θ3 may leave the range of eq. 5: no equation becomes singular then, and it says nothing
    where no element reads them. `trusted_until` may be unknown, or earlier than the end. Numbers of
    a config may overflow or underflow in the rates.
    """
    warnings = []
    if trajectory.status is RunStatus.DIVERGED and len(trajectory.times) == 1:
        warnings.append(
            "numbers of the config are too small or too large: its rates underflow or overflow in "
            "double precision"
        )
    for index, name in ((0, "θ1"), (2, "θ3")) if reads_angles else ():
        outside = np.abs(trajectory.states[:, index]) > math.pi
        if outside.any():
            t = trajectory.times[int(outside.argmax())]
            warnings.append(f"{name} is outside [-π, π], the range of eq. 5, from t = {t:.6g} s")
    trusted = trajectory.trusted_until
    if trusted is not None and np.isnan(trusted):
        warnings.append("trusted_until is unknown: the time limit ended the run that determines it")
    elif trusted is not None and trusted < _last_comparable(trajectory):
        warnings.append(
            f"the motion is not reproducible after t = {trusted:.6g} s (trusted_until): a start "
            "that differs in the last digit leads to another motion"
        )
    return warnings


def _last_comparable(trajectory: Trajectory) -> float:
    """Return the last time at which two runs of one motion can be compared, s."""
    completed = trajectory.status is RunStatus.COMPLETED
    # Where a run ends early, its last sample is no common one.
    return float(trajectory.times[-1 if completed else max(-2, -len(trajectory.times))])


def resolution_warnings(
    integration: Any, trajectory: Trajectory, variables: dict[str, Variable]
) -> list[str]:
    """Return a warning for each quantity that is small beside the error allowed in a step.

    An engine controls the error of the state vector: heyoka relative to its largest entry, SciPy
    relative to each entry plus `atol`. So a small quantity can lose its digits, while v, a sum of
    energies, still balances. Runs that stopped early because they met a limit have their status.

    Args:
        integration: The settings of the integration.
        trajectory: The trajectory.
        variables: The quantities of the run, by their names.
    """
    if trajectory.status not in (RunStatus.COMPLETED, RunStatus.RANGE_LEFT, RunStatus.ZERO_LENGTH):
        return []
    if integration.engine == "heyoka":
        allowed = integration.rtol * float(np.abs(trajectory.states).max())
        reason = "rtol times the largest state"
    else:
        allowed, reason = integration.atol, "atol"
    sizes = {name: float(np.abs(variables[name].data).max()) for name in CHECKED}
    return [
        f"{name}: its largest value is {size:.2g} {variables[name].unit}, but the tolerance allows "
        f"an error of {allowed:.2g} in a step ({reason}): it guarantees {_digits(allowed / size)} "
        "digits"
        for name, size in sizes.items()
        if 0 < size * LARGEST_SHARE < allowed
    ]


def inverse_warnings(system: System) -> list[str]:
    """Return a warning for each matrix whose inverse, as the equations use it, has lost digits.

    The equations use cofactors. They lose digits if the matrix has very different eigenvalues and
    is not diagonal. The inverse is a part of the equations, so v can balance nevertheless.
    """
    given = parameters(system)
    matrices = {"body.inertia": given["body.inertia"]}
    if system.coordinates.name == "reduced":
        matrices["body.inertia"] = system.body.inertia_about_contact
    if "connector.L_d" in given:
        matrices["controller.L_d"] = given["connector.L_d"]
    with np.errstate(all="ignore"):
        errors = {
            name: float(np.abs(matrix @ inverse(matrix) - np.eye(3)).max())
            for name, matrix in matrices.items()
        }
    return [
        f"{name}: its inverse has a relative error of {error:.2g}, because its eigenvalues differ "
        f"too much for a matrix that is not diagonal: it guarantees {_digits(error)} digits"
        for name, error in errors.items()
        if error > LARGEST_INVERSE_ERROR
    ]


def _digits(share: float) -> int:
    """Return the number of digits of a value with this relative error."""
    return max(0, int(-np.log10(share)))
