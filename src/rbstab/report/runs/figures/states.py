"""The states over time, grouped as in the paper's figures 3 to 7, and of several runs together."""

from collections.abc import Sequence

from rbstab.report.model.figure import Figure
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import components, having, overlay, scalar, side_by_side

ROTATION = ("orientation", "angular_velocity")
TRANSLATION = ("position", "velocity")
LYAPUNOV = ("lyapunov", "lyapunov_rate")

IN_THE_PAPER = {"visco-elastic": ("Fig. 4", "Fig. 5"), "embedded": ("Fig. 6", "Fig. 7")}
"""The figures of its Cases 2 and 3: rotation with v and v', translation with E."""

OVERLAID = {
    "rotation": ("Rotation", ROTATION),
    "translation": ("Translation of the centre of gravity", TRANSLATION),
    "contact": ("Motion of the contact point", ("contact_displacement", "contact_velocity")),
    "force": ("Contact force", ("contact_force",)),
    "connector": ("Own state of the connector", ("connector_state",)),
}
"""The vectors that are drawn component by component, all runs together: name, title, vectors."""


def state_figures(run: Run) -> list[Figure]:
    """The paper's figures of a run: one for a held body, else one of rotation, one of translation.

    A body that is held moves only as it turns, so that its figure 3 has everything.
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
                _as("Fig. 3"),
            ),
        )
    rotation, translation = IN_THE_PAPER.get(variant, ("", ""))
    displaced = (*TRANSLATION, "contact_displacement", "connector_state")
    return _figures(
        run,
        ("rotation", "Rotation and Lyapunov function", ROTATION, LYAPUNOV, _as(rotation)),
        ("translation", "Translation and constraint", displaced, (), _as(translation)),
    )


def overlaid_states(runs: Sequence[Run]) -> list[Figure]:
    """Each vector of several runs: a row for each component, a colour for each run."""
    return [
        Figure(
            name=f"runs-{name}",
            title=title,
            panels=tuple(
                overlay(runs, vector, component) for component in range(3) for vector in vectors
            ),
            columns=len(vectors),
            shares_time=True,
        )
        for name, (title, vectors) in OVERLAID.items()
        if having(runs, *vectors)
    ]


def _figures(
    run: Run, *wanted: tuple[str, str, tuple[str, ...], tuple[str, ...], str]
) -> list[Figure]:
    found = []
    for name, title, vectors, scalars, source in wanted:
        panels = [components(run, vector) for vector in vectors if vector in run.result]
        panels += [scalar(run, quantity) for quantity in scalars if quantity in run.result]
        found.append(
            Figure(
                name=f"{run.name}-{name}",
                title=f"{title}: {run.label}",
                panels=tuple(panels),
                columns=side_by_side(panels),
                source=source,
                shares_time=True,
            )
        )
    return found


def _as(figure: str) -> str:
    return f"as {figure}" if figure else ""
