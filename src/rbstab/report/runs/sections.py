"""The sections of a report on its runs: all together, then one by one."""

from collections.abc import Sequence

from rbstab.report.model.document import Block, Section
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.distributions import distribution_figure
from rbstab.report.runs.figures.eigenvalues import eigenvalue_blocks
from rbstab.report.runs.figures.energy import energy_figure, force_figure
from rbstab.report.runs.figures.lyapunov import audit_figure, decay_figure, residual_figure
from rbstab.report.runs.figures.phase import overlaid_phases, phase_figure
from rbstab.report.runs.figures.sliding import sliding_figures
from rbstab.report.runs.figures.states import overlaid_states, state_figures

MAX_CURVES = 24
"""Runs that are drawn as curves: of more, nobody could tell the curves apart."""


def run_sections(runs: Sequence[Run]) -> tuple[Section, ...]:
    """The figures of runs.

    Args:
        runs: The runs. Of more than `MAX_CURVES` only distributions are drawn.

    Returns:
        "runs-compared" (several runs) or "runs-decay" (one), "runs-eigenvalues", and for each run
        one named like "run-1-figures"; nothing for no run.
    """
    if not runs:
        return ()
    if len(runs) > MAX_CURVES:
        said = (
            f"These are {len(runs)} runs. Of more than {MAX_CURVES} no curves are drawn, but how "
            "their outcomes are spread."
        )
        blocks: tuple[Block, ...] = (said, distribution_figure(runs))
        return (Section("runs-distributions", "Outcomes of all runs", blocks),)
    sections = [_together(runs)]
    eigenvalues = eigenvalue_blocks(runs)
    if eigenvalues:
        sections.append(Section("runs-eigenvalues", "Eigenvalues at the rest state", eigenvalues))
    return (*sections, *(_alone(run) for run in runs))


def _together(runs: Sequence[Run]) -> Section:
    if len(runs) == 1:
        return Section("runs-decay", "Decay", (decay_figure(runs),))
    return Section(
        "runs-compared",
        "Runs compared",
        (
            decay_figure(runs),
            *overlaid_states(runs),
            overlaid_phases(runs),
            residual_figure(runs),
        ),
    )


def _alone(run: Run) -> Section:
    figures = (
        *state_figures(run),
        energy_figure(run),
        force_figure(run),
        phase_figure(run),
        *sliding_figures(run),
        audit_figure(run),
    )
    return Section(f"{run.name}-figures", f"Figures of {run.label}", figures)
