"""Report sections with the figures of runs: all runs together, then each run."""

from collections.abc import Sequence

from rbstab.report.model.document import Block, Section
from rbstab.report.model.figure import Figure
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.distributions import distribution_figure
from rbstab.report.runs.figures.eigenvalues import eigenvalue_blocks
from rbstab.report.runs.figures.empty_panels import without_empty_panels
from rbstab.report.runs.figures.energy import element_figures, energy_figure, force_figures
from rbstab.report.runs.figures.extremes import extremes_in_colour
from rbstab.report.runs.figures.lyapunov import (
    audit_figure,
    decay_figure,
    residual_figure,
    supply_figures,
)
from rbstab.report.runs.figures.phase import overlaid_phases, phase_figure
from rbstab.report.runs.figures.sliding import sliding_figures
from rbstab.report.runs.figures.states import overlaid_states, state_figures
from rbstab.report.runs.figures.stop import stop_figures

MAX_CURVES = 24
"""Maximum number of runs drawn as curves; readers cannot distinguish more."""


def run_sections(runs: Sequence[Run]) -> tuple[Section, ...]:
    """Return the sections with the figures of runs.

    Args:
        runs: The runs. For more than `MAX_CURVES` only distributions are drawn.

    Returns:
        The section "runs-compared" (several runs) or "runs-decay" (one run), the section
        "runs-eigenvalues", and a section such as "run-1-figures" for each run; () without runs.
    """
    if not runs:
        return ()
    if len(runs) > MAX_CURVES:
        sentence = (
            f"The report has {len(runs)} runs. With more than {MAX_CURVES} runs it shows the "
            "distributions of their outcomes in place of curves."
        )
        blocks: tuple[Block, ...] = (sentence, distribution_figure(runs))
        return (Section("runs-distributions", "Outcomes of all runs", blocks),)
    looks, sentence = extremes_in_colour(runs)
    eigenvalues = eigenvalue_blocks(looks)
    found = Section("runs-eigenvalues", "Eigenvalues at the rest state", eigenvalues)
    between = (found,) if eigenvalues else ()
    if len(runs) == 1:
        # The decay has the time axis of all other figures of the run.
        decay, *others = _shown((decay_figure(runs), *_run_figures(runs[0])))
        return (
            Section("runs-decay", "Decay", (decay,)),
            *between,
            _run_section(runs[0], others, folded=False),
        )
    # Of curves that cover each other, the last one is seen.
    ordered = sorted(looks, key=lambda run: not run.legend)
    overlaid = (
        decay_figure(ordered),
        *overlaid_states(ordered),
        overlaid_phases(ordered),
        residual_figure(ordered),
    )
    compared = (*([sentence] if sentence else []), *_shown(overlaid))
    return (
        Section("runs-compared", "Comparison of runs", compared),
        *between,
        *(_run_section(run, _shown(_run_figures(run)), folded=True) for run in runs),
    )


def _run_section(run: Run, blocks: Sequence[Block], *, folded: bool) -> Section:
    title = f"Figures of {run.label}"
    return Section(f"{run.name}-figures", title, tuple(blocks), folded=folded)


def _run_figures(run: Run) -> tuple[Figure, ...]:
    return (
        *state_figures(run),
        *supply_figures(run),
        energy_figure(run),
        *force_figures(run),
        *element_figures(run),
        phase_figure(run),
        *sliding_figures(run),
        *stop_figures(run),
        audit_figure(run),
    )


def _shown(figures: Sequence[Figure]) -> list[Block]:
    """Return figures as they are shown: without empty panels."""
    return [without_empty_panels(figure) for figure in figures]
