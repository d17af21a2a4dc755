"""`rbstab stability`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import ALLOW_PYTHON, CHANGES, QUIET, REPLACE_FILE, output_file

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager

    from rbstab.config.schema import Config
    from rbstab.config.tolerances import Tolerance
    from rbstab.experiment.convergence.convergence import Convergence, Enclose
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.integrate.problem import Problem
    from rbstab.store.result import Result


@click.command("stability")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@click.option("--search-only", is_flag=True, help="Search for rest states without a proof.")
@click.option(
    "--along",
    "alongs",
    multiple=True,
    metavar="KEY=FROM:TO:COUNT",
    help="Compute the eigenvalues for COUNT factors on a gain, geometrically spaced from FROM to "
    "TO: controller.K_r=0.01:1:41. Repeatable.",
)
@click.option(
    "--within",
    "withins",
    multiple=True,
    metavar="KEY=±SIZE",
    help="Prove convergence for everything within tolerances: for all bodies, with keys of body, "
    "gravity and controller (controller=±20%, body.contact_point=±0.01), or for all starts "
    "(initial.angular_velocity=±0.5). +- may stand for ±. Repeatable.",
)
@click.option(
    "--largest-within",
    "largest",
    multiple=True,
    metavar="KEY",
    help="Find the largest percentage p for which KEY=±p% is proved, beside the tolerances of "
    "--within. Repeatable: each KEY by itself.",
)
@click.option(
    "--time-limit",
    metavar="SECONDS",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Wall time for the proof of --within, and for each --largest-within; what is proved by "
    "then is printed.  [default: 60, or 600 for tolerances of the initial state]",
)
@CHANGES
@ALLOW_PYTHON
@click.option(
    "--results",
    default="results",
    show_default=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of results; proofs are stored in DIR/proofs and read from there.",
)
@click.option("--no-run", is_flag=True, help="Leave out the run and its certificate.")
@click.option("--json", "as_json", is_flag=True, help="Print all results as JSON.")
@output_file("Write the output to FILE instead of printing it.")
@REPLACE_FILE
@QUIET
def command(
    configs: tuple[Path, ...],
    search_only: bool,
    alongs: tuple[str, ...],
    withins: tuple[str, ...],
    largest: tuple[str, ...],
    time_limit: float | None,
    changes: tuple[str, ...],
    allow_python: bool,
    results: Path,
    no_run: bool,
    as_json: bool,
    output: Path | None,
    force: bool,
    quiet: bool,
) -> None:
    """Find the rest states of configs, and prove where motions converge.

    For each CONFIG, prints: its rest states, stable and unstable, and whether the list is proved to
    be complete; whether every start, or almost every start, converges to a stable one; the region
    in which convergence is proved; whether the initial state is inside, and if not, when its exact
    motion enters; the linearised system at each rest state; the certificate of its run. A finished
    run is read from DIR; a new run is not stored.

    With --json, `search` says how the search for rest states ended, `proved` whether `states` are
    all of them, `stable_count` how many are stable. `every_start` is whether every start is proved
    to converge. `almost_every_start` has the same of almost every start: `proved`, `returns`
    (whether all of the rest states that are reached are near the desired orientation), their
    numbers `states`, and `why` it is not proved. Of a body whose energy depends on no Euler angles,
    `on_rotations` has the quaternions of all rest states on SO(3), and families of them.
    """
    from rbstab.config.build import problem_of
    from rbstab.experiment.convergence.convergence import Enclose
    from rbstab.experiment.stability import stability_of
    from rbstab_cli.arguments.along import checked_along, locus_points
    from rbstab_cli.arguments.within import checked_tolerances, proved_within
    from rbstab_cli.output.printed import stdout_to_file
    from rbstab_cli.output.progress import compiling, working
    from rbstab_cli.output.stability_report import StabilityReport, stability_data
    from rbstab_cli.output.stability_tables import print_stability_report
    from rbstab_cli.output.text_file import check_target

    if search_only and (withins or largest):
        option = "--within" if withins else "--largest-within"
        raise click.UsageError(f"--search-only makes no proofs: leave out {option}")
    if output is not None:
        check_target(output, force=force)
    loaded = load_all(configs, changes, allow_python=allow_python)
    tolerances = checked_tolerances(loaded, withins, largest)
    loci = checked_along(loaded, alongs)
    reports = []
    for path, config in loaded.items():
        with _shown(path.name, tolerances[path], largest, quiet=quiet) as progress:
            within = proved_within(
                config, results, withins, tolerances[path], largest, progress, time_limit
            )
        problem = problem_of(config)
        with working(f"{path.name}: rest states", wanted=not quiet):
            proof = _proof(config, problem, results, search_only=search_only)
        enclose = Enclose.NOTHING if search_only else Enclose.UNTIL_PROVED
        label = compiling(config.integration.engine, len(problem.system.elements)) or "exact motion"
        with working(f"{path.name}: {label}", wanted=not (quiet or (no_run and search_only))):
            stored = results / f"{path.stem}.h5"
            run = None if no_run else _run(config, problem, stored, proof, enclose)
            found = None if search_only else _convergence(config, problem, proof, run)
        stability = stability_of(problem, proof, found)
        points = [(along, locus_points(config, along)) for along in loci]
        reports.append(StabilityReport(path, config, stability, run, points, within))
    with stdout_to_file(output, force=force):
        if as_json:
            from rbstab_cli.output.json_output import print_json

            print_json([stability_data(report) for report in reports])
        else:
            for report in reports:
                print_stability_report(report)


def _shown(
    name: str, tolerances: "Sequence[Tolerance]", largest: tuple[str, ...], *, quiet: bool
) -> "AbstractContextManager[Any]":
    """Show the progress of the proofs within tolerances of one config; without them nothing."""
    from rbstab_cli.arguments.within import are_of_starts
    from rbstab_cli.output.progress import starts_proved, working

    if are_of_starts(tolerances):
        return starts_proved(f"{name}: all starts", wanted=not quiet)
    return working(f"{name}: all bodies", wanted=bool(tolerances or largest) and not quiet)


def _proof(config: "Config", problem: "Problem", results: Path, *, search_only: bool) -> "Proof":
    from rbstab.experiment.proof import prove
    from rbstab.experiment.proof_cache import OLDER, cached_proof, is_older, proof_for
    from rbstab.store.errors import StoreError

    try:
        if search_only:
            found = cached_proof(results, config)
            decided = found is not None and (found.proved or found.states)
            return found if found and decided else prove(config, problem, search_only=True)
        if is_older(results, config):
            click.echo(f"{results}: {OLDER}", err=True)
        return proof_for(results, config, problem)
    except StoreError as error:
        # Print the proof although it cannot be read or stored.
        click.echo(f"warning: {error}; the proof is not stored", err=True)
        return prove(config, problem, search_only=search_only)


def _convergence(
    config: "Config", problem: "Problem", proof: "Proof", run: "Result | None"
) -> "Convergence":
    """Return what is proved of the exact motion: that of the run, or else it is followed now."""
    from rbstab.experiment.convergence.convergence import Enclose, stored_convergence
    from rbstab.experiment.convergence.exact_motion import prove_convergence

    found = None if run is None else stored_convergence(run.attributes)
    if found is not None and found.enclosed.covers(Enclose.UNTIL_PROVED):
        return found
    return prove_convergence(config, problem, proof).convergence


def _run(
    config: "Config", problem: "Problem", file: Path, proof: "Proof", enclose: "Enclose"
) -> "Result":
    """Return the stored run of a config if it has finished, or else integrate it."""
    from rbstab.experiment.run_to_file import finished_run
    from rbstab.experiment.simulate import simulate_problem
    from rbstab.integrate.engines import EngineMissingError

    found = finished_run(config, problem, file, proof=proof)
    if found is not None:
        return found
    try:
        return simulate_problem(config, problem, proof=proof, enclose=enclose)
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
