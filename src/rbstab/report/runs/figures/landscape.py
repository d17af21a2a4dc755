"""The energy that a motion needs to turn to an angle θ2, with and without a barrier."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics.numbers import Array
from rbstab.proof.profile import least_along_pitch, without_barriers
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run

PITCH = np.linspace(-np.pi / 2, np.pi / 2, 241)
"""rad."""

RANGE_END = np.array([np.pi, np.pi / 2, np.pi])
"""rad: the ends of θ1, θ2 and θ3 in the range of eq. 5."""

LEAST_COLOUR = 6
"""Number of the palette colour of energies: grey."""

BARE, GUARDED = ("run without barrier", 1), ("run with barrier", 2)
"""Names and colours of motions: the same in all panels, which have runs of their own."""

HEADROOM = 1.15
"""The figure ends at this multiple of the largest energy of a motion or of the border."""

COMPARED = 4.0
"""Panels have one scale if the largest of their energies is at most this multiple of the least."""

CAPTION = (
    "Grey: the least stored energy at each angle θ2, over all real θ1 and θ3, without a barrier "
    "and with one. A motion has at least this energy, so it stays above the curve. Coloured: the "
    "energy of each run along its motion; it never grows. All energies are above that of the "
    "lowest rest state. Without a barrier the curve is finite at θ2 = ±π/2: a motion with more "
    "energy may leave the range there. A barrier raises the curve beyond all bounds, so that no "
    "motion can. At a stop the curve ends."
)


class Landscape(NamedTuple):
    """One body and controller, with its runs.

    Attributes:
        title: The heading of its panel.
        bare: The proof without a barrier, if it is stored.
        guarded: The proof with one, if it is stored.
        bare_runs: Its runs without a barrier.
        guarded_runs: Its runs with one.
    """

    title: str
    bare: Proof | None
    guarded: Proof | None
    bare_runs: Sequence[Run]
    guarded_runs: Sequence[Run]


class _Curves(NamedTuple):
    """What is drawn of one body: energies above that of its lowest rest state, J.

    top is the end of an axis that shows its motions and the border of the range.
    """

    profiles: list[tuple[Array, str]]
    motions: list[Line]
    states: Points
    top: float


def landscape_figure(landscapes: Sequence[Landscape]) -> Figure:
    """Return the figure, with a panel for each body.

    The panels have one scale, unless one of the bodies would be flat on it.
    """
    found = [_curves(landscape) for landscape in landscapes]
    largest = max(curves.top for curves in found)
    has_one_scale = len(found) > 1 and largest <= COMPARED * min(curves.top for curves in found)
    tops = [largest if has_one_scale else curves.top for curves in found]
    panels = map(_panel, found, tops, [landscape.title for landscape in landscapes])
    return Figure(
        "energy-landscape",
        "Energy that is needed to reach θ2",
        tuple(panels),
        columns=min(3, len(landscapes)),
        caption=CAPTION,
        shared="xy" if has_one_scale else "",
    )


def _curves(landscape: Landscape) -> _Curves:
    """Return the curves of one body, its rest states, and its runs."""
    known = landscape.bare or landscape.guarded
    assert known is not None
    zero = known.states[0].energy if known.states else 0.0
    profiles = [(y - zero, label) for y, label in _profiles(landscape)]
    motions = [
        Line(run.result["orientation"][:, 1], _energies(run) - zero, label, colour)
        for runs, (label, colour) in (
            (landscape.bare_runs, BARE),
            (landscape.guarded_runs, GUARDED),
        )
        for run in runs
    ]
    proofs = [proof for proof in (landscape.bare, landscape.guarded) if proof is not None]
    states = [state for proof in proofs for state in proof.states]
    at = np.array([(state.orientation[1], state.energy - zero) for state in states]).reshape(-1, 2)
    marks = Points(at[:, 0], at[:, 1], "rest state", LEAST_COLOUR)
    top = HEADROOM * max(_largest(profiles[0][0]), *(_largest(line.y) for line in motions))
    return _Curves(profiles, motions, marks, top)


def _panel(curves: _Curves, top: float, title: str) -> Panel:
    """Return the least energies up to the top of the panel, and the runs above them."""
    marks: list[Mark] = [
        Line(PITCH, np.where(y <= top, y, np.nan), label, LEAST_COLOUR, dash)
        for dash, (y, label) in enumerate(curves.profiles)
    ]
    marks += [*curves.motions, curves.states]
    return Panel(Axis("angle θ2", "rad"), Axis("energy", "J"), tuple(marks), title)


def _profiles(landscape: Landscape) -> list[tuple[Array, str]]:
    """Return the least energies along θ2 and their labels: without a barrier, and with it."""
    found: list[tuple[Array, str]] = []
    for proof, label in ((landscape.bare, ""), (landscape.guarded, "with barrier")):
        if proof is None or proof.reduced_energy is None:
            continue
        energy, wide = proof.reduced_energy.energy, proof.unwrapped
        end = RANGE_END if wide is None or wide.end is None else np.array(wide.end)
        if not found:
            bare = least_along_pitch(without_barriers(energy), PITCH, end)
            found.append((bare, "least, without barrier"))
        if label:
            found.append((least_along_pitch(energy, PITCH, end), "least, with barrier"))
    return found


def _energies(run: Run) -> Array:
    """Return the sum of all energies of a run along its motion, J."""
    total: Array = run.result["energy"].sum(axis=1)
    return total


def _largest(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max(initial=0.0))
