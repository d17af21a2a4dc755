"""Printed results of `rbstab stability`."""

from typing import TYPE_CHECKING, Any

import click
import numpy as np

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.locus import LocusPoint
    from rbstab.experiment.stability import Stability
    from rbstab_cli.arguments.along import Along
    from rbstab_cli.output.stability_report import StabilityReport

HELD = (
    "held: a force that jumps here balances the load, that of a repelling guard or a stop at its "
    "angle of θ2, or of an element of your own at its switch. The kind is that of motions that "
    "stay at this angle or switch; no eigenvalues are given."
)

ON_A_RIDGE = (
    "on a ridge: the force of an element of your own jumps here, and pushes away to both sides. A "
    "force between both balances the load: a body can rest here, but it may leave at any time. The "
    "way across the ridge counts as one direction of descent; no eigenvalues are given."
)


def print_stability_report(report: "StabilityReport") -> None:
    """Print the statements about one config, then the tables behind them."""
    from rbstab.config.errors import printable
    from rbstab.experiment.answers.words import run_words
    from rbstab.integrate.status import RunStatus
    from rbstab_cli.output.certificate import print_certificate

    stability, run = report.stability, report.run
    click.echo(f"{report.path}: {printable(report.config.title)}\n")
    within = [] if report.within is None else report.within.statements
    for statement in [*within, *stability.statements]:
        click.echo(f"  {statement}")
    if run is not None:
        ended = "" if run.status == RunStatus.COMPLETED else f" It ended early: {run.status}."
        word = run_words(str(run.attributes["verdict"]))
        click.echo(f"  Checks of the computed run: {word}.{ended}")
    click.echo()
    if stability.proof.states:
        _print_rest_states(stability)
        _print_modes(stability)
    _print_undecided(stability)
    if run is not None:
        print_certificate(run)
    for along, points in report.loci:
        _print_locus(report.config, along, points)
    if stability.proof.states or report.loci:
        _print_surface_modes(report.config)


def _print_rest_states(stability: "Stability") -> None:
    from rbstab.experiment.stability import kind_of
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    numbers = ("energy [J]", "slowest τ [s]")
    table = new_table("#", "kind", "Θ [rad]", "X [m]", *numbers, "proved", numbers=numbers)
    pairs = zip(stability.proof.states, stability.linearisations, strict=True)
    for index, (state, linear) in enumerate(pairs, start=1):
        add_row(
            table,
            str(index),
            kind_of(state),
            _vector(state.orientation),
            _vector(state.position),
            number(round(state.energy, 9) + 0.0, 6),
            "-" if linear is None else number(float(linear.time_constants[0])),
            "yes" if state.proved else "no",
        )
    print_table(table)
    states = stability.proof.states
    if any(state.held and not state.ridge for state in states):
        click.echo(f"{HELD}\n")
    if any(state.ridge for state in states):
        click.echo(f"{ON_A_RIDGE}\n")


def _print_modes(stability: "Stability") -> None:
    """Print the modes of the lowest rest state, if it has any, one row for each conjugate pair."""
    from rbstab.analysis.linearisation import eigenvalue_text
    from rbstab_cli.output.stability_report import mode_data
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    modes = mode_data(stability.linearisations[0])
    if not modes:
        return
    click.echo("Modes at rest state 1:")
    numbers = ("λ [1/s]", "|λ| [rad/s]", "ζ", "τ [s]")
    table = new_table("mode", *numbers, "moves most", numbers=numbers)
    for index, mode in enumerate(modes, start=1):
        cells = (
            number(mode[key]) for key in ("natural_frequency", "damping_ratio", "time_constant")
        )
        add_row(
            table,
            str(index),
            eigenvalue_text(complex(*mode["eigenvalue"])),
            *cells,
            mode["largest"],
        )
    print_table(table)


def _print_surface_modes(config: "Config") -> None:
    """Say which modes are missing: those of a connector that slides on s = F + κE."""
    slope = getattr(getattr(config.controller, "surface", None), "slope", None)
    if slope is not None:
        click.echo(
            f"Not listed: the three modes of the surface, on which E decays as exp(-κt), κ = "
            f"{slope:g} 1/s. The table is of the body that is held at E = 0.\n"
        )


def _print_undecided(stability: "Stability") -> None:
    from rbstab.mechanics.attitude import is_upright

    boxes = stability.proof.undecided
    undecided = [box for box in boxes if is_upright(np.array(box).T).all()]
    if len(undecided) < len(boxes):
        click.echo(f"  {AT_POLES}")
    for low, high in undecided[:10]:
        click.echo(f"  undecided: Θ between {_vector(low)} and {_vector(high)} rad")
    if len(undecided) > 10:
        click.echo(f"  undecided: and {len(undecided) - 10} more boxes")


AT_POLES = (
    "at θ2 = ±90°, the open end of the range: not decided. There the angles are singular, and "
    "∂U/∂Θ is zero also where a couple acts on the body."
)

NOT_FOUND = "none: a descent in energy from Θ = 0 found no smooth rest state in the range"
"""Where a point of a root locus has no eigenvalues. Other searches may find rest states."""


def _print_locus(config: "Config", along: "Along", points: "list[LocusPoint]") -> None:
    from rbstab.analysis.linearisation import eigenvalue_text
    from rbstab.experiment.answers.threshold import named_number
    from rbstab.experiment.locus import stable_from
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    gain = named_number(config, along.path)
    numbers = ("factor", gain.text, "largest Re λ [1/s]", "smallest ζ", "growing")
    table = new_table(*numbers, "eigenvalues [1/s]", numbers=numbers)
    click.echo(f"Along {along.key}:")
    if _has_no_effect(points):
        # So it is with the force of a sliding connector, which only has to be large enough.
        click.echo(f"  {along.key} does not change the linearised system.")
        points = points[:1]
    for factor, _, linear, _ in points:
        value = number(factor * gain.value)
        if linear is None:
            add_row(table, number(factor), value, "-", "-", "-", NOT_FOUND)
            continue
        values = linear.eigenvalues
        shown = [eigenvalue_text(value) for value in values.tolist() if value.imag >= 0]
        add_row(
            table,
            number(factor),
            value,
            number(float(values.real.max())),
            number(float(linear.damping_ratios.min())),
            str(linear.growing),
            ", ".join(shown),
        )
    print_table(table)
    sentence = stable_from(config, gain, points)
    if sentence:
        click.echo(f"  {sentence[:1].upper()}{sentence[1:]}.\n")


def _has_no_effect(points: "list[LocusPoint]") -> bool:
    """Whether all points have the same eigenvalues, bit for bit."""
    systems = [point.linearisation for point in points]
    values = {None if one is None else one.eigenvalues.tobytes() for one in systems}
    return len(points) > 1 and len(values) == 1 and None not in values


def _vector(values: Any) -> str:
    # Digits below a nanoradian or a nanometre are only round-off.
    return "(" + ", ".join(f"{round(value, 9) + 0.0:.5g}" for value in values) + ")"
