"""The animated motion of a body, reduced to the frames that a view needs."""

import numpy as np
from scipy.spatial.transform import Rotation

from rbstab.config.build import system_of
from rbstab.config.elements import declarations_of, parameter
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import without_code
from rbstab.elements.declarations import ANCHOR, POINT
from rbstab.mechanics import attitude
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Animation, Tie
from rbstab.report.reading.sources import Run
from rbstab.report.runs.solid import solid_of

MAX_FRAMES = 360
"""Maximum number of frames. A page stores the pose of each; more would not be visible."""


@np.errstate(all="ignore")
def animation_of(run: Run) -> Animation:
    """Return the motion of a run's body, with its shape.

    Raises:
        ValueError: The config, which describes the body, cannot be read; or no state is finite.
    """
    if run.config is None:
        raise ValueError(f"{run.label}: the body is unknown because the config cannot be read")
    # A stored result must not run code of a user; the body does not depend on it.
    system = system_of(without_code(run.config))
    X, Theta = run.result["position"], run.result["orientation"]
    finite = np.flatnonzero(np.isfinite(X).all(axis=1) & np.isfinite(Theta).all(axis=1))
    if not len(finite):
        raise ValueError(f"{run.label}: the run has no finite state")
    turns = Rotation.from_matrix(attitude.rotations(Theta[finite]))
    times = run.result["time"][finite]
    count = min(len(times), MAX_FRAMES)
    frames = np.linspace(0, len(times) - 1, count).round().astype(np.intp)
    has_anchor = run.config.controller.variant not in ("none", "free")
    return Animation(
        name=run.name,
        title=run.label,
        times=times[frames],
        positions=X[finite][frames],
        rotations=turns[frames].as_quat(scalar_first=True),
        solid=solid_of(system.body),
        contact_point=system.body.contact_point,
        # E is measured from the contact point at X = 0, Θ = 0, moved by X_a (eq. 38).
        anchor=system.body.contact_point + system.anchor if has_anchor else None,
        ties=_ties(run, run.config, turns[frames], finite[frames]),
    )


def _ties(run: Run, config: Config, turns: Rotation, samples: Array) -> tuple[Tie, ...]:
    """Return the elements with a point and an anchor, with their loads at some samples."""
    if "element_force" not in run.result:
        return ()
    forces = run.result["element_force"][samples].swapaxes(0, 1)
    by_name = dict(zip(run.result["element"].tolist(), forces, strict=True))
    X = run.result["position"][samples]
    ties = []
    for name, section in config.elements.items():
        if name not in by_name or not {POINT, ANCHOR} <= set(declarations_of(section).gains):
            continue
        point, anchor = (np.array(parameter(section, end.name)) for end in (POINT, ANCHOR))
        toward = anchor - (X + turns.apply(point))
        along = (by_name[name] * toward).sum(axis=1)
        loads = np.copysign(np.linalg.norm(by_name[name], axis=-1), along)
        ties.append(Tie(name, point, anchor, loads))
    return tuple(ties)
