"""The motion of a run's body in space, in as many frames as a view needs."""

import numpy as np
from scipy.spatial.transform import Rotation

from rbstab.config.build import system_of
from rbstab.mechanics import attitude
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Motion
from rbstab.report.reading.sources import Run
from rbstab.report.runs.solid import bone_of, semi_axes

MAX_FRAMES = 360
"""More are not seen; a page keeps only where the body is in each."""


def motion_of(run: Run) -> Motion:
    """The motion of a run's body, with a shape for it.

    Raises:
        ValueError: The config of the run cannot be read, so that its body is not known; or the run
            has no finite state.
    """
    if run.config is None:
        raise ValueError(f"{run.label}: the body is not known, for its config cannot be read")
    system = system_of(run.config)
    X, Theta = run.result["position"], run.result["orientation"]
    finite = np.flatnonzero(np.isfinite(X).all(axis=1) & np.isfinite(Theta).all(axis=1))
    if not len(finite):
        raise ValueError(f"{run.label}: the run has no finite state")
    turns = Rotation.from_matrix(np.array([attitude.rotation(angles) for angles in Theta[finite]]))
    times = run.result["time"][finite]
    lengths, _ = semi_axes(system.body)
    kept = _kept(times, X[finite] / lengths[-1], turns)
    tied = run.config.controller.variant != "free"
    return Motion(
        name=run.name,
        title=run.label,
        times=times[kept],
        positions=X[finite][kept],
        rotations=turns[kept].as_quat(scalar_first=True),
        solid=bone_of(system.body),
        contact_point=system.body.contact_point,
        # E counts from where the contact point is at X = 0, Θ = 0, moved by X_a (eq. 38).
        anchor=system.body.contact_point + system.anchor if tied else None,
    )


def _kept(times: Array, places: Array, turns: Rotation) -> Array:
    """The numbers of the frames: closer in time where the body moves more."""
    count = len(times)
    if count <= MAX_FRAMES:
        return np.arange(count)
    steps = (turns[:-1].inv() * turns[1:]).magnitude()
    steps = steps + np.linalg.norm(np.diff(places, axis=0), axis=1)
    shares = [_share(np.diff(times)), _share(steps)]
    path = np.concatenate([[0.0], np.cumsum(sum(shares))])
    wanted = np.linspace(0.0, path[-1], MAX_FRAMES)
    return np.unique([0, *np.searchsorted(path, wanted).clip(max=count - 1), count - 1])


def _share(steps: Array) -> Array:
    total = steps.sum()
    return steps / total if total > 0 else np.zeros(len(steps))
