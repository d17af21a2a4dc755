"""The figures of runs: at most six, chosen by what the runs have."""

from collections.abc import Sequence
from dataclasses import replace

from rbstab.config.user_code.permission import has_code
from rbstab.report.model.document import Block, Section
from rbstab.report.model.figure import Figure
from rbstab.report.model.words import listed
from rbstab.report.runs.facts import RunFacts
from rbstab.report.runs.figures.eigenvalues import eigenvalue_figure
from rbstab.report.runs.figures.events import events_figure
from rbstab.report.runs.figures.extremes import extremes_in_colour
from rbstab.report.runs.figures.landscape import landscape_figure
from rbstab.report.runs.figures.lyapunov import decay_figure, energy_figure
from rbstab.report.runs.figures.states import contact_figure, phase_figure, rotation_figure

MOST_FIGURES = 6


def figures_section(facts: Sequence[RunFacts]) -> Section:
    """Return the section with the figures of runs."""
    runs, sentence = extremes_in_colour([entry.run for entry in facts])
    shown = {run.name: run for run in runs}
    looks = [
        replace(entry, run=shown[entry.run.name]) for entry in facts if entry.run.name in shown
    ]
    # Of curves that cover each other, the last one is seen.
    looks.sort(key=lambda entry: not entry.run.legend)
    title = "Figures" if len(facts) == 1 else "Comparison of runs"
    blocks: list[Block] = [*([sentence] if sentence else []), *_figures(looks)]
    with_code = [run.label for run in runs if run.config is not None and has_code(run.config)]
    if with_code:
        blocks.append(
            "No eigenvalues are drawn for runs with elements of users, whose code a report never "
            f"runs: {listed(with_code)}. The command rbstab stability --allow-python prints them."
        )
    return Section("figures", title, tuple(blocks))


def _figures(facts: Sequence[RunFacts]) -> list[Figure]:
    """Return the figures, the most important ones first."""
    runs = [entry.run for entry in facts]
    alone = runs[0] if len(runs) == 1 else None
    found = (
        rotation_figure(runs),
        contact_figure(runs),
        decay_figure(runs),
        landscape_figure(facts),
        events_figure(alone) if alone else None,
        energy_figure(alone) if alone else None,
        eigenvalue_figure(runs),
        phase_figure(runs),
    )
    return [figure for figure in found if figure is not None][:MOST_FIGURES]
