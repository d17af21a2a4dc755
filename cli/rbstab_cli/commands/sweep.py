"""`rbstab sweep`."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import CHANGES
from rbstab_cli.arguments.plans import is_of_a_sweep, sweep_name

if TYPE_CHECKING:
    from rbstab.sweep.folder.parts import Part
    from rbstab.sweep.options import SweepOptions
    from rbstab.sweep.plan.plan import Plan


def _part(_context: click.Context, _parameter: click.Parameter, text: str | None) -> "Part | None":
    """The part that --shard names."""
    if text is None:
        return None
    from rbstab.sweep.folder.parts import part_of

    try:
        return part_of(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from error


@click.command("sweep")
@click.argument("plan", required=False, metavar="PLAN", type=click.Path(path_type=Path))
@click.option(
    "--status",
    "status_of",
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Say how far the sweep in the folder DIR is, and do nothing.",
)
@click.option(
    "-o",
    "--output",
    default="results",
    show_default=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of the results; PLAN.yaml gives the folder DIR/PLAN.",
)
@CHANGES
@click.option(
    "--engine",
    type=click.Choice(["heyoka", "scipy"]),
    help="The integrator, whatever the base says; default heyoka where it is installed.",
)
@click.option(
    "--threads",
    type=click.IntRange(1),
    help="Members followed side by side; default: as many as processors.",
)
@click.option("--shard-size", type=click.IntRange(1), help="Members that are stored together.")
@click.option(
    "--shard",
    "part",
    metavar="I/N",
    callback=_part,
    help="Compute part I of N only, beside others; `rbstab gather` joins them.",
)
@click.option(
    "--dask",
    metavar="ADDRESS",
    help="Compute on the Dask cluster whose scheduler is at ADDRESS (or described in a JSON file).",
)
@click.option(
    "--dry-run", is_flag=True, help="Say how much there is to do, and how long it will take."
)
@click.option(
    "--retry-failed",
    is_flag=True,
    help="Repeat members that diverged, hit a limit or could not be integrated.",
)
@click.option("--fail-fast", is_flag=True, help="Stop at the first such member.")
@click.option("--force", is_flag=True, help="Move a different sweep of the same name aside.")
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON.")
@click.option(
    "-q", "--quiet", is_flag=True, help="No progress and no advice; errors are still said."
)
def command(
    plan: Path | None,
    status_of: Path | None,
    output: Path,
    changes: tuple[str, ...],
    engine: str | None,
    threads: int | None,
    shard_size: int | None,
    part: "Part | None",
    dask: str | None,
    dry_run: bool,
    retry_failed: bool,
    fail_fast: bool,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run all members of a plan and store what becomes of them.

    PLAN is a YAML file (see docs/sweeps.md). The same command goes on where the last one stopped,
    however that came; nothing that is done is repeated. A member that does not complete is stored
    with its status. If none completes, the exit code is 3.
    """
    from rbstab.store.errors import StoreError

    if (plan is None) == (status_of is None):
        raise click.UsageError("expected either PLAN or --status DIR")
    given: dict[str, object] = {
        "--shard": part,
        "--force": force,
        "--dask": dask,
        "--threads": threads,
    }
    given["--dry-run"] = dry_run
    _refuse_together(given, "--shard", "--force")
    _refuse_together(given, "--dask", "--threads", "--dry-run")
    try:
        if status_of is not None:
            from rbstab_cli.output.sweep_report import report_status

            report_status(status_of, as_json=as_json)
        elif plan is not None:
            from rbstab.sweep.options import SweepOptions

            folder = output / sweep_name(plan)
            name = _engine(engine, folder, plan)
            loaded = _loaded(plan, (*changes, f"integration.engine={name}"))
            options = SweepOptions(None, threads, shard_size, retry_failed, fail_fast, force, part)
            if dry_run:
                from rbstab_cli.output.sweep_report import report_estimate

                report_estimate(loaded, folder, options, as_json=as_json)
            else:
                _sweep(loaded, folder, options, dask, as_json=as_json, quiet=quiet)
    except StoreError as error:
        click.echo(f"{plan or status_of}: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error


def _engine(wanted: str | None, folder: Path, plan: Path) -> str:
    """The engine: the wanted one, or that with which the sweep was begun, or the fastest."""
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.sweep.folder.sweep_folder import engine_of
    from rbstab.sweep.members.engines import factory_for, fastest

    name = wanted or engine_of(folder)
    if name is None and is_of_a_sweep(plan):
        name = engine_of(plan.parent)
    if name is None:
        name = fastest()
        if name == "scipy":
            click.echo("heyoka is not installed: scipy is used, which takes much longer", err=True)
    try:
        factory_for(name)
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
    return name


def _loaded(path: Path, changes: tuple[str, ...]) -> "Plan":
    """The plan; ends the command with exit code 2 and everything that is wrong."""
    from rbstab.config.build import config_warnings
    from rbstab.config.errors import ConfigError
    from rbstab.sweep.plan.load import load_plan

    try:
        plan = load_plan(path, changes)
    except ConfigError as error:
        for problem in dict.fromkeys(map(str, error.problems)):
            click.echo(problem, err=True)
        raise click.exceptions.Exit(exit_codes.USAGE) from error
    warnings = [warning for base in plan.bases.values() for warning in config_warnings(base)]
    for warning in dict.fromkeys(warnings):
        click.echo(f"warning: {path}: {warning}", err=True)
    return plan


def _sweep(
    plan: "Plan",
    folder: Path,
    options: "SweepOptions",
    cluster: str | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    from rbstab.sweep.sweep import sweep_to_folder
    from rbstab_cli.sweep_run import carry_out

    with ExitStack() as stack:
        if cluster is not None:
            from rbstab_cli.arguments.cluster import connected

            options = replace(options, executor=stack.enter_context(connected(cluster, plan)))
        carry_out(
            lambda on_event, stop: sweep_to_folder(plan, folder, options, on_event, stop),
            fail_fast=options.fail_fast,
            as_json=as_json,
            quiet=quiet,
        )


def _refuse_together(given: dict[str, object], first: str, *others: str) -> None:
    """Ends the command with exit code 2 where options were given of which one rules out others."""
    for other in others:
        if given[first] and given[other]:
            raise click.UsageError(f"{first} cannot be combined with {other}")
