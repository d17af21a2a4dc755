"""Where the energy of a run is, and what takes it away; its forces."""

from rbstab.report.figure import Figure, Panel, Stack
from rbstab.report.run_figures.curves import TIME, axis_of, components
from rbstab.report.sources import Run


def energy_figure(run: Run) -> Figure:
    """Energy and dissipation by part, stacked."""
    labels = tuple(str(part) for part in run.result["part"])
    panels = [
        Panel(TIME, axis_of(name), (Stack(run.result["time"], run.result[name], labels),))
        for name in ("energy", "dissipation")
    ]
    return Figure(
        f"{run.name}-energy",
        f"Energy and dissipation by part: {run.label}",
        tuple(panels),
        columns=2,
        caption="The energies add up to v and the energy at rest, the dissipations to -v'.",
        shares_time=True,
    )


def force_figure(run: Run) -> Figure:
    """The contact force, and what the stabilizers exert, by axis."""
    names = ("contact_force", "stabilizing_force", "stabilizing_couple")
    return Figure(
        f"{run.name}-forces",
        f"Forces: {run.label}",
        tuple(components(run, name) for name in names if name in run.result),
        columns=2,
        shares_time=True,
    )
