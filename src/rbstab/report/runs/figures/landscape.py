"""The energy that a motion needs to turn to an angle θ2, with and without a barrier."""

import json
from collections.abc import Sequence

import numpy as np

from rbstab.config.load import acting_sections
from rbstab.config.schema import Config
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics.numbers import Array
from rbstab.proof.profile import least_along_pitch, without_barriers
from rbstab.report.model.figure import MUTED, Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.model.words import listed
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import axis_of, has_guard

PITCH = np.linspace(-np.pi / 2, np.pi / 2, 241)
"""rad."""

RANGE_END = np.array([np.pi, np.pi / 2, np.pi])
"""rad: the ends of θ1, θ2 and θ3 in the range of eq. 5."""

HEADROOM = 1.15
"""A panel ends at this multiple of the largest energy of a motion or of the border."""

MOST = 6
"""At most so many bodies are shown; each has a panel."""

CAPTION = (
    "Grey: the least stored energy at each θ2, without a barrier and with one; no motion is below "
    "it. Coloured: the energy of each run."
)

LEVEL_CAPTION = " Below c*, dashed, every motion is proved to converge."


def landscape_figure(runs: Sequence[Run]) -> Figure | None:
    """Return the figure, with a panel for each body; None if no proof has an energy.

    Runs of one body and controller, with and without barriers, share a panel.
    """
    bodies: dict[str, list[tuple[Run, Proof]]] = {}
    for run in runs:
        proof = run.proof
        if run.config is not None and proof is not None and proof.reduced_energy is not None:
            bodies.setdefault(_without_barriers(run.config), []).append((run, proof))
    panels = tuple(_panel(body) for body in list(bodies.values())[:MOST])
    if not panels:
        return None
    title = "Energy that is needed to reach θ2"
    has_level = any(isinstance(mark, Level) for panel in panels for mark in panel.marks)
    caption = CAPTION + (LEVEL_CAPTION if has_level else "")
    return Figure("energy-landscape", title, panels, min(3, len(panels)), caption=caption)


def _without_barriers(config: Config) -> str:
    """Return what acts on the body but for barriers, as text."""
    sections = acting_sections(config)
    elements = sections.get("elements", {})
    others = {n: e for n, e in elements.items() if e.get("method") != "barrier"}
    return json.dumps(sections | {"elements": others}, sort_keys=True)


def _panel(body: Sequence[tuple[Run, Proof]]) -> Panel:
    """Return the least energies, rest states, levels and runs, above the lowest rest state."""
    proofs = {has_guard(run, "barrier"): proof for run, proof in body}
    first = next(iter(proofs.values()))
    zero = first.states[0].energy if first.states else 0.0
    marks: list[Mark] = [
        Line(
            run.result["orientation"][:, 1],
            run.result["energy"].sum(axis=1) - zero,
            run.label,
            run.number,
            group=run.legend,
        )
        for run, _ in body
    ]
    least: dict[str, Array] = {}
    states: list[tuple[float, float]] = []
    for guarded, proof in sorted(proofs.items(), key=lambda pair: pair[0]):
        if proof.reduced_energy is None:
            continue
        energy, wide = proof.reduced_energy.energy, proof.unwrapped
        end = RANGE_END if wide is None or wide.end is None else np.array(wide.end)
        curves = {"without": without_barriers(energy)} | ({"with": energy} if guarded else {})
        for word, U in curves.items():
            least.setdefault(f"least, {word} barrier", least_along_pitch(U, PITCH, end) - zero)
        if proof.region is not None and proof.region.proved:
            marks.append(Level(proof.region.lower_bound, "c*"))
        states += [(state.orientation[1], state.energy - zero) for state in proof.states]
    shown = least["least, without barrier"], *(line.y for line in marks if isinstance(line, Line))
    top = HEADROOM * max(float(y.max(where=np.isfinite(y), initial=0.0)) for y in shown)
    profiles = [
        Line(PITCH, np.where(y <= top, y, np.nan), label, MUTED, dash)
        for dash, (label, y) in enumerate(least.items())
    ]
    at = np.array([state for state in states if state[1] <= top]).reshape(-1, 2)
    rest = Points(at[:, 0], at[:, 1], "rest state", MUTED)
    title = listed(run.label for run, _ in body)
    return Panel(axis_of("orientation", 1), Axis("energy", "J"), (*profiles, *marks, rest), title)
