"""`rbstab stability`."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import CHANGES, REPLACE_FILE, output_file

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.proof import Proof
    from rbstab.experiment.stability import Stability
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
@CHANGES
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
def command(
    configs: tuple[Path, ...],
    search_only: bool,
    alongs: tuple[str, ...],
    changes: tuple[str, ...],
    results: Path,
    no_run: bool,
    as_json: bool,
    output: Path | None,
    force: bool,
) -> None:
    """Find the rest states of configs, and prove where motions converge.

    For each CONFIG, prints: its rest states, and whether the list is proved to be complete; whether
    "globally stable" can hold; the region in which convergence is proved, and whether the initial
    state is inside; the linearised system at each rest state; the certificate of its run. A
    finished run is read from DIR; a new run is not stored.
    """
    from rbstab.config.build import problem_of
    from rbstab_cli.arguments.along import locus_points, parse_along
    from rbstab_cli.output.printed import stdout_to_file
    from rbstab_cli.output.stability_report import StabilityReport, stability_data
    from rbstab_cli.output.stability_tables import print_stability_report
    from rbstab_cli.output.text_file import check_target

    if output is not None:
        check_target(output, force=force)
    loaded = load_all(configs, changes)
    loci = [parse_along(text) for text in alongs]
    reports = []
    for path, config in loaded.items():
        problem = problem_of(config)
        stability = _stability(config, problem, results, search_only=search_only)
        run = None if no_run else _run(path, config, problem, results, stability.proof)
        points = [(along, locus_points(config, along)) for along in loci]
        reports.append(StabilityReport(path, config, stability, run, points))
    with stdout_to_file(output, force=force):
        if as_json:
            from rbstab_cli.output.json_output import print_json

            print_json([stability_data(report) for report in reports])
        else:
            for report in reports:
                print_stability_report(report)


def _stability(
    config: "Config", problem: "Problem", results: Path, *, search_only: bool
) -> "Stability":
    from rbstab.experiment.proof import prove
    from rbstab.experiment.proof_cache import cached_proof, proof_for
    from rbstab.experiment.stability import stability_of
    from rbstab.store.errors import StoreError

    try:
        if search_only:
            found = cached_proof(results, config)
            proof = found or prove(config, problem, search_only=True)
        else:
            proof = proof_for(results, config, problem)
    except StoreError as error:
        # Print the proof although it cannot be read or stored.
        click.echo(f"warning: {error}; the proof is not stored", err=True)
        proof = prove(config, problem, search_only=search_only)
    return stability_of(problem, proof)


def _run(
    path: Path, config: "Config", problem: "Problem", results: Path, proof: "Proof"
) -> "Result":
    """Return the stored run of a config if it has finished, or else integrate it."""
    from rbstab.experiment.run_to_file import finished_run
    from rbstab.experiment.simulate import simulate_problem
    from rbstab.integrate.engines import EngineMissingError

    found = finished_run(config, problem, results / f"{path.stem}.h5", proof=proof)
    if found is not None:
        return found
    try:
        return simulate_problem(config, problem, proof=proof)
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
