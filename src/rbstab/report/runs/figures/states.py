"""Figures of the states over time.

The figures of one run follow figures 3 to 7 of the paper. Other figures overlay several runs.
"""

from collections.abc import Sequence

from rbstab.elements.registry import OWN_STATES
from rbstab.report.model.figure import Figure
from rbstab.report.model.words import listed
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import (
    FORCES,
    WORK_NOTE,
    column_count,
    components,
    element_states,
    layered,
    overlay,
    runs_with,
    scalar,
)

ROTATION = ("orientation", "angular_velocity")
TRANSLATION = ("position", "velocity")
LYAPUNOV = ("lyapunov", "lyapunov_rate")

PAPER_FIGURES = {"visco-elastic": ("Fig. 4", "Fig. 5"), "embedded": ("Fig. 6", "Fig. 7")}
"""Figures of the paper's Cases 2 and 3: rotation with v and v', translation with E."""

OVERLAID = {
    "rotation": ("Rotation", ROTATION),
    "translation": ("Translation of the centre of gravity", TRANSLATION),
    "contact": ("Motion of the contact point", ("contact_displacement", "contact_velocity")),
    "force": ("Contact force", ("contact_force",)),
    **{
        name.removesuffix("_state"): (name.replace("_", " ").capitalize(), (name,))
        for name in OWN_STATES
    },
}
"""Figures that overlay all runs, with a row for each component: name, title, vectors."""


def state_figures(run: Run) -> list[Figure]:
    """Return the paper's figures of a run: one for a held body, otherwise rotation and translation.

    A body with a held contact point only rotates, so figure 3 shows all its states.
    """
    variant = str(run.result.attributes.get("variant", ""))
    if variant == "permanent":
        return _figures(
            run,
            (
                "states",
                "States and Lyapunov function",
                ROTATION + TRANSLATION,
                LYAPUNOV,
                _source("Fig. 3"),
            ),
        )
    rotation, translation = PAPER_FIGURES.get(variant, ("", ""))
    displaced = (*TRANSLATION, "contact_displacement", *OWN_STATES, *element_states(run))
    return _figures(
        run,
        ("rotation", "Rotation and Lyapunov function", ROTATION, LYAPUNOV, _source(rotation)),
        ("translation", "Translation and constraint", displaced, (), _source(translation)),
    )


def overlaid_states(runs: Sequence[Run]) -> list[Figure]:
    """Return a figure for each vector: a row for each component, a colour for each run."""
    own = dict.fromkeys(name for run in runs for name in element_states(run))
    figures = OVERLAID | {
        name.replace(".", "-"): (f"Own state of {name.partition('.')[0]}", (name,)) for name in own
    }
    return [
        _overlaid(name, title, vectors, acting, _left_out(title, runs, acting))
        for name, (title, vectors) in figures.items()
        if (acting := _acting(runs, vectors))
    ]


def _acting(runs: Sequence[Run], vectors: tuple[str, ...]) -> list[Run]:
    """Return the runs that have the vectors: a force that is zero throughout acts in none."""
    force = [name for name in vectors if name in FORCES]
    return [r for r in runs_with(runs, *vectors) if all(r.result[name].any() for name in force)]


def _left_out(title: str, runs: Sequence[Run], shown: Sequence[Run]) -> str:
    """Return a sentence that names the runs that a figure does not show; "" if it shows all."""
    names = [run.label for run in runs if run not in shown]
    return f"{title}: none in {listed(names)}." if names else ""


def _overlaid(
    name: str, title: str, vectors: tuple[str, ...], runs: Sequence[Run], caption: str
) -> Figure:
    panels = [
        overlay(runs, vector, component)
        for component in range(_size(runs, vectors[0]))
        for vector in vectors
    ]
    return Figure(
        name=f"runs-{name}",
        title=title,
        panels=layered(panels),
        columns=len(vectors),
        caption=caption,
        shares_time=True,
    )


def _size(runs: Sequence[Run], vector: str) -> int:
    return min(run.result[vector].shape[1] for run in runs_with(runs, vector))


def _figures(
    run: Run, *specifications: tuple[str, str, tuple[str, ...], tuple[str, ...], str]
) -> list[Figure]:
    figures = []
    for name, title, vectors, scalars, source in specifications:
        panels = [components(run, vector) for vector in vectors if vector in run.result]
        panels += [scalar(run, quantity) for quantity in scalars if quantity in run.result]
        figures.append(
            Figure(
                name=f"{run.name}-{name}",
                title=f"{title}: {run.label}",
                panels=tuple(panels),
                columns=column_count(panels),
                source=source,
                caption=WORK_NOTE if run.stores_v_minus_work and "lyapunov" in scalars else "",
                shares_time=True,
            )
        )
    return figures


def _source(figure: str) -> str:
    return f"as the paper's {figure}" if figure else ""
