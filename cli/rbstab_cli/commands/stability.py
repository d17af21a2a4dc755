"""`rbstab stability`."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli.arguments.configs import CHANGES, load_all

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.experiment.stability import Stability
    from rbstab.store.result import Result


@click.command("stability")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=click.Path(path_type=Path)
)
@click.option("--search-only", is_flag=True, help="Search for rest states, and prove nothing.")
@click.option(
    "--along",
    "alongs",
    multiple=True,
    metavar="KEY=FROM:TO:COUNT",
    help="Follow the eigenvalues while a gain is multiplied by factors FROM to TO, equally spaced "
    "in their logarithm: controller.K_r=0.01:1:41. Repeatable.",
)
@CHANGES
@click.option(
    "--results",
    default="results",
    show_default=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of results, where proofs are kept (DIR/proofs) and read.",
)
@click.option("--no-run", is_flag=True, help="Leave out the certificate of the run itself.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write it to a file instead of printing it.",
)
@click.option("--force", is_flag=True, help="Replace FILE if it exists.")
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
    """Say what is proved, what is only seen and what is false of configs.

    For each CONFIG: its rest states, proved to be all or not; whether "globally stable" can hold;
    the region in which convergence is proved, and whether this start is inside; the linearised
    system at each rest state; and the certificate of its run, which is read from DIR if it is
    finished there.
    """
    from rbstab_cli.arguments.along import parsed, points_of
    from rbstab_cli.output.printed import printed_to
    from rbstab_cli.output.stability_report import StabilityReport, data_of
    from rbstab_cli.output.stability_tables import print_stability_report
    from rbstab_cli.output.text_file import refuse_taken

    if output is not None:
        refuse_taken(output, force=force)
    loaded = load_all(configs, changes)
    wanted = [parsed(text) for text in alongs]
    answers = [
        StabilityReport(
            path,
            config,
            stability := _stability(config, results, search_only=search_only),
            None if no_run else _run(path, config, results, stability),
            [(along, points_of(config, along)) for along in wanted],
        )
        for path, config in loaded.items()
    ]
    with printed_to(output, force=force):
        if as_json:
            from rbstab_cli.output.json_output import print_json

            print_json([data_of(answer) for answer in answers])
        else:
            for answer in answers:
                print_stability_report(answer)


def _stability(config: "Config", results: Path, *, search_only: bool) -> "Stability":
    from rbstab.experiment.proof import prove
    from rbstab.experiment.proof_cache import cached_proof, proof_for
    from rbstab.experiment.stability import stability_of
    from rbstab.store.errors import StoreError

    if search_only:
        proof = cached_proof(results, config) or prove(config, search_only=True)
        return stability_of(config, proof)
    try:
        proof = proof_for(results, config)
    except StoreError as error:
        # What was proved is worth saying, though it cannot be kept.
        click.echo(f"warning: {error}; the proof is not kept", err=True)
        proof = prove(config)
    return stability_of(config, proof)


def _run(path: Path, config: "Config", results: Path, stability: "Stability") -> "Result":
    """The run of a config: that in the folder of results if it is finished there, or a new one."""
    from rbstab.experiment.run_to_file import finished_run
    from rbstab.experiment.simulate import simulate
    from rbstab.integrate.engines import EngineMissingError

    proof = stability.proof
    found = finished_run(config, results / f"{path.stem}.h5", proof=proof)
    if found is not None:
        return found
    try:
        return simulate(config, proof=proof)
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
