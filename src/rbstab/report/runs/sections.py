"""The figures of runs: at most six, chosen by what the runs have."""

from collections.abc import Sequence

import numpy as np

from rbstab.config.user_code.permission import has_code
from rbstab.report.model.document import Block, Section
from rbstab.report.model.words import listed
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.eigenvalues import eigenvalue_figure
from rbstab.report.runs.figures.events import events_figure
from rbstab.report.runs.figures.extremes import extremes_in_colour
from rbstab.report.runs.figures.landscape import landscape_figure
from rbstab.report.runs.figures.lyapunov import decay_figure, energy_figure
from rbstab.report.runs.figures.states import contact_figure, phase_figure, rotation_figure

MOST_FIGURES = 6


@np.errstate(all="ignore")
def figures_section(runs: Sequence[Run]) -> Section:
    """Return the section with the figures of runs, the most important ones first."""
    looks, sentence = extremes_in_colour(runs)
    # Of curves that cover each other, the last one is seen.
    shown = sorted(looks, key=lambda run: not run.legend)
    figures = [
        rotation_figure(shown),
        contact_figure(shown),
        decay_figure(shown),
        landscape_figure(shown),
        *([events_figure(shown[0]), energy_figure(shown[0])] if len(shown) == 1 else []),
        eigenvalue_figure(shown),
        phase_figure(shown),
    ]
    blocks: list[Block] = [sentence] if sentence else []
    blocks += [figure for figure in figures if figure is not None][:MOST_FIGURES]
    with_code = [run.label for run in looks if run.config is not None and has_code(run.config)]
    if with_code:
        blocks.append(
            "No eigenvalues are drawn for runs with elements of users, whose code a report never "
            f"runs: {listed(with_code)}. The command rbstab stability --allow-python prints them."
        )
    title = "Figures" if len(runs) == 1 else "Comparison of runs"
    return Section("figures", title, tuple(blocks))
