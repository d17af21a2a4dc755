"""What `rbstab stability` prints of one config: statements and tables, or plain data."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

from rbstab.analysis.linearisation import Linearisation, eigenvalue_text
from rbstab.config.schema import Config
from rbstab.experiment.answers.motors import motor_answers
from rbstab.experiment.answers.rounded import number, vector
from rbstab.experiment.answers.words import run_words
from rbstab.experiment.disturbed.bound import Bound
from rbstab.experiment.stability import Stability, kind_of
from rbstab.experiment.stored_proof.almost_every_start import almost_every_start
from rbstab.files.text import printable
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.attitude import is_upright
from rbstab.store.result import Result
from rbstab_cli.output.runs import certificate_checks, print_certificate
from rbstab_cli.printing import Table
from rbstab_cli.work.stability.along import Locus, locus_data, print_locus
from rbstab_cli.work.stability.within import Within

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

AT_POLES = (
    "at θ2 = ±90°, the open end of the range: not decided. There the angles are singular, and "
    "∂U/∂Θ is zero also where a couple acts on the body."
)

MAX_BOXES = 10
"""The most undecided boxes that are printed."""


class Analysis(NamedTuple):
    """A config, its stability, its run (None with --no-run), and its root loci.

    within is what is proved within tolerances, and bound what is proved of disturbances; None if
    that was not asked for.
    """

    path: Path
    config: Config
    stability: Stability
    run: Result | None
    loci: list[Locus]
    within: Within | None
    bound: Bound | None


def data_of(analysis: Analysis) -> dict[str, Any]:
    """Return all results for one config as plain data."""
    stability, run = analysis.stability, analysis.run
    # The reduced energy is only needed where a proof is used or checked.
    proof = stability.proof.model_dump(mode="json", exclude={"reduced_energy"})
    states = zip(proof.pop("states"), stability.linearisations, strict=True)
    certificate = None
    if run is not None:
        verdict, status = run.attributes["verdict"], run.status
        certificate = {"verdict": verdict, "status": status, "lines": certificate_checks(run)}
    return {
        "config": str(analysis.path),
        "title": analysis.config.title,
        "statements": stability.statements,
        "within": None if analysis.within is None else analysis.within.as_data(),
        "motors": [motor.as_data() for motor in motor_answers(analysis.config)],
        "bound": None if analysis.bound is None else analysis.bound.as_data(),
        "start": stability.start,
        "inside": stability.inside,
        "convergence": None if stability.convergence is None else stability.convergence.as_data(),
        "reached": stability.reached,
        # A run has an outcome of its own.
        "search": proof.pop("outcome"),
        **proof,
        "stable_count": stability.proof.stable_count,
        "every_start": stability.proof.every_start,
        "almost_every_start": almost_every_start(stability.proof).as_data(),
        "states": [{**state, "modes": _mode_data(linear)} for state, linear in states],
        "certificate": certificate,
        "along": [locus_data(locus) for locus in analysis.loci],
    }


def _mode_data(linear: Linearisation | None) -> list[dict[str, Any]]:
    """Return the modes, slowest first; a conjugate pair is given by the mode with Im λ > 0."""
    modes: list[dict[str, Any]] = []
    if linear is None:
        return modes
    for k, value in enumerate(linear.eigenvalues):
        if value.imag < 0:
            continue
        shape = linear.modes[:, k]
        modes.append(
            {
                "eigenvalue": [float(value.real), float(value.imag)],
                "natural_frequency": float(linear.natural_frequencies[k]),
                "damping_ratio": float(linear.damping_ratios[k]),
                "time_constant": float(linear.time_constants[k]),
                "largest": linear.states[int(abs(shape).argmax())],
                "shape": {
                    name: [float(entry.real), float(entry.imag)]
                    for name, entry in zip(linear.states, shape, strict=True)
                },
            }
        )
    return modes


def print_analysis(analysis: Analysis) -> None:
    """Print the statements about one config, then the tables behind them."""
    stability, run = analysis.stability, analysis.run
    click.echo(f"{analysis.path}: {printable(analysis.config.title)}\n")
    within = [] if analysis.within is None else analysis.within.statements
    bound = [] if analysis.bound is None else analysis.bound.statements
    for statement in [*within, *bound, *stability.statements]:
        click.echo(f"  {statement}")
    for motor in motor_answers(analysis.config):
        click.echo(f"  {motor}.")
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
    for locus in analysis.loci:
        print_locus(locus)
    if stability.proof.states or analysis.loci:
        _print_surface_modes(analysis.config)


def _print_rest_states(stability: Stability) -> None:
    numbers = ("energy [J]", "slowest τ [s]")
    table = Table("#", "kind", "Θ [rad]", "X [m]", *numbers, "proved", numbers=numbers)
    states = stability.proof.states
    pairs = zip(states, stability.linearisations, strict=True)
    for index, (state, linear) in enumerate(pairs, start=1):
        table.add(
            str(index),
            kind_of(state),
            _rounded(state.orientation),
            _rounded(state.position),
            number(round(state.energy, 9) + 0.0, 6),
            "-" if linear is None else number(float(linear.time_constants[0])),
            "yes" if state.proved else "no",
        )
    table.print()
    if any(state.held and not state.ridge for state in states):
        click.echo(f"{HELD}\n")
    if any(state.ridge for state in states):
        click.echo(f"{ON_A_RIDGE}\n")


def _print_modes(stability: Stability) -> None:
    """Print the modes of the lowest rest state, if it has any, one row for each conjugate pair."""
    modes = _mode_data(stability.linearisations[0])
    if not modes:
        return
    click.echo("Modes at rest state 1:")
    numbers = ("λ [1/s]", "|λ| [rad/s]", "ζ", "τ [s]")
    table = Table("mode", *numbers, "moves most", numbers=numbers)
    for index, mode in enumerate(modes, start=1):
        value = eigenvalue_text(complex(*mode["eigenvalue"]))
        keys = ("natural_frequency", "damping_ratio", "time_constant")
        table.add(str(index), value, *(number(mode[key]) for key in keys), mode["largest"])
    table.print()


def _print_surface_modes(config: Config) -> None:
    """Say which modes are missing: those of a connector that slides on s = F + κE."""
    slope = getattr(getattr(config.controller, "surface", None), "slope", None)
    if slope is not None:
        click.echo(
            f"Not listed: the three modes of the surface, on which E decays as exp(-κt), κ = "
            f"{slope:g} 1/s. The table is of the body that is held at E = 0.\n"
        )


def _print_undecided(stability: Stability) -> None:
    boxes = stability.proof.undecided
    undecided = [box for box in boxes if is_upright(np.array(box).T).all()]
    if len(undecided) < len(boxes):
        click.echo(f"  {AT_POLES}")
    for low, high in undecided[:MAX_BOXES]:
        click.echo(f"  undecided: Θ between {_rounded(low)} and {_rounded(high)} rad")
    if len(undecided) > MAX_BOXES:
        click.echo(f"  undecided: and {len(undecided) - MAX_BOXES} more boxes")


def _rounded(values: Iterable[float]) -> str:
    # Digits below a nanoradian or a nanometre are only round-off.
    return vector((round(value, 9) + 0.0 for value in values), 5)
