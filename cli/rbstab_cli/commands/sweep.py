"""`rbstab sweep`."""

from contextlib import ExitStack
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from rbstab.processes.imports import keep_imports
from rbstab_cli import exit_codes
from rbstab_cli.arguments.choice import Choice
from rbstab_cli.arguments.configs import exit_on_problems, print_plan_warnings
from rbstab_cli.arguments.engine import refuse_engine_change
from rbstab_cli.arguments.options import ALLOW_PYTHON, AS_JSON, CHANGES, QUIET, results_folder
from rbstab_cli.arguments.outputs import check_proofs_folder, check_results_folder
from rbstab_cli.arguments.plans import is_in_sweep_folder, sweep_name

if TYPE_CHECKING:
    from rbstab.sweep.folder.open_folder import Part
    from rbstab.sweep.options import SweepOptions
    from rbstab.sweep.plan.plan import Plan
    from rbstab.sweep.sweep import Sweep
    from rbstab_cli.output.sweeps.sweep_answers import Answers


def _part(_context: click.Context, _parameter: click.Parameter, text: str | None) -> "Part | None":
    """Parse the value I/N of --part."""
    if text is None:
        return None
    from rbstab.sweep.folder.open_folder import parse_part

    try:
        return parse_part(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from error


def _part_by_old_name(
    context: click.Context, parameter: click.Parameter, text: str | None
) -> "Part | None":
    """Parse the value I/N of --shard, and warn that the option is called --part now."""
    # Shell completion parses the line too, but must print nothing.
    if text is not None and not context.resilient_parsing:
        click.echo("warning: --shard is called --part now. Use --part I/N.", err=True)
    return _part(context, parameter, text)


@click.command("sweep")
@click.argument("plan", required=False, metavar="PLAN", type=click.Path(path_type=Path))
@click.option(
    "--status",
    "status_of",
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Show the status of the sweep in the folder DIR, and run nothing.",
)
@results_folder("PLAN.yaml gives the folder DIR/PLAN")
@CHANGES
@click.option(
    "--engine",
    type=Choice(["heyoka", "scipy"]),
    help="Integrator; default: that of the stored sweep, or else heyoka if it is installed. "
    "The engine of the base is not used.",
)
@click.option(
    "--threads",
    type=click.IntRange(1),
    help="Threads that integrate members; default: one for each processor.",
)
@click.option("--shard-size", type=click.IntRange(1), help="Members in each shard (file).")
@click.option(
    "--part",
    "part",
    metavar="I/N",
    callback=_part,
    help="Compute only part I of N. When all parts are done, run it without this option.",
)
@click.option("--shard", "old_part", metavar="I/N", callback=_part_by_old_name, hidden=True)
@click.option(
    "--dask",
    metavar="ADDRESS",
    help="Compute on a Dask cluster. ADDRESS is its scheduler's address, or its JSON file.",
)
@click.option(
    "--dry-run", is_flag=True, help="Count the members and the disk space, and run nothing."
)
@click.option(
    "--retry-failed",
    is_flag=True,
    help="Rerun shards with failed members (diverged, hit a limit, not integrated).",
)
@click.option("--fail-fast", is_flag=True, help="Stop at the first failed member.")
@click.option(
    "--compare",
    metavar="N",
    type=click.IntRange(1),
    help="Members that scipy computes again, for comparison; default: 4.",
)
@click.option(
    "--prove/--no-prove",
    default=None,
    help="When the results are stored, the rest states of each distinct body are proved for at "
    "most 10 seconds, and the members that start where convergence is proved are counted. "
    "--prove: without a limit of time, and with more boxes for tied bodies with springs. "
    "--no-prove: nothing is proved.",
)
@click.option("--force", is_flag=True, help="Move a different sweep of the same name aside.")
@ALLOW_PYTHON
@AS_JSON
@QUIET
@click.pass_context
def command(
    context: click.Context,
    plan: Path | None,
    status_of: Path | None,
    output: Path,
    changes: tuple[str, ...],
    engine: str | None,
    threads: int | None,
    shard_size: int | None,
    part: "Part | None",
    old_part: "Part | None",
    dask: str | None,
    dry_run: bool,
    retry_failed: bool,
    fail_fast: bool,
    compare: int | None,
    prove: bool | None,
    force: bool,
    allow_python: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run all members of a plan and store their outcomes.

    PLAN is a YAML file (see docs/sweeps.md). Run the same command again to resume a stopped sweep;
    finished shards are not computed again. A member that does not complete is stored with its
    status. If no member completes, the exit code is 3.
    """
    from rbstab.store.errors import StoreError

    if (plan is None) == (status_of is None):
        raise click.UsageError("expected either PLAN or --status DIR")
    if status_of is not None:
        _refuse_beside_status(context)
    given: dict[str, object] = {
        "--part": part,
        "--shard": old_part,
        "--force": force,
        "--dask": dask,
        "--threads": threads,
        "--compare": compare,
    }
    given["--dry-run"] = dry_run
    _refuse_together(given, "--part", "--shard", "--force", "--compare")
    _refuse_together(given, "--shard", "--force", "--compare")
    _refuse_together(given, "--dask", "--threads", "--dry-run")
    part = part or old_part
    try:
        if status_of is not None:
            from rbstab_cli.output.sweeps.sweep_report import report_status

            report_status(status_of, as_json=as_json)
        elif plan is not None:
            folder = output / sweep_name(plan)
            refuse_engine_change(changes)
            with keep_imports():
                name, is_slow = _engine(engine, folder, plan)
                changes = (*changes, f"integration.engine={name}")
                loaded = _load(plan, changes, allow_python=allow_python)
                proves = prove is not False and loaded.prove is None
                if check_results_folder(output, [folder]) and proves and not (dry_run or part):
                    check_proofs_folder(output, lambda: False)
                if is_slow:
                    click.echo(WITHOUT_HEYOKA, err=True)
                if not dry_run:
                    import_module("rbstab.sweep.sweep")
            from rbstab.sweep.options import SweepOptions

            options = SweepOptions(
                None,
                threads,
                shard_size,
                retry_failed,
                fail_fast,
                force,
                part,
                compare=compare,
            )
            if dry_run:
                from rbstab_cli.output.sweeps.sweep_report import report_dry_run

                report_dry_run(loaded, folder, options, as_json=as_json)
            else:
                _sweep(
                    *(loaded, folder, options, dask),
                    as_json=as_json,
                    quiet=quiet,
                    prove=False if loaded.prove is not None else prove,
                )
    except StoreError as error:
        from rbstab.sweep.folder.open_folder import OtherSweepError

        # The status is of a folder, which the error names.
        click.echo(f"{plan}: {error}" if plan else str(error), err=True)
        is_other = isinstance(error, OtherSweepError)
        raise click.exceptions.Exit(exit_codes.USAGE if is_other else exit_codes.STORAGE) from error


WITHOUT_HEYOKA = "heyoka is not installed: using scipy, which is much slower"


def _engine(wanted: str | None, folder: Path, plan: Path) -> tuple[str, bool]:
    """Return the engine: the wanted one, or the one of the stored sweep, or the fastest.

    Returns:
        The name, and whether it is slow because heyoka is not installed.

    Raises:
        UsageError: The engine is not installed.
    """
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.sweep.folder.sweep_folder import engine_of
    from rbstab.sweep.members.engines import factory_for, fastest_engine

    name = wanted or engine_of(folder)
    if name is None and is_in_sweep_folder(plan):
        name = engine_of(plan.parent)
    is_slow = name is None and fastest_engine() == "scipy"
    name = name or fastest_engine()
    try:
        factory_for(name)
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
    return name, is_slow


def _load(path: Path, changes: tuple[str, ...], *, allow_python: bool) -> "Plan":
    """Load a plan; if it has errors, print all of them and end the command with exit code 2."""
    from rbstab.config.errors import ConfigError
    from rbstab.sweep.plan.load import load_plan
    from rbstab_cli.arguments.plans import plan_problem_lines

    try:
        plan = load_plan(path, changes, allow_python=allow_python)
    except ConfigError as error:
        exit_on_problems(dict.fromkeys(plan_problem_lines(path, error)))
        raise
    print_plan_warnings(path, plan)
    return plan


def _sweep(
    plan: "Plan",
    folder: Path,
    options: "SweepOptions",
    cluster: str | None,
    *,
    as_json: bool,
    quiet: bool,
    prove: bool | None,
) -> None:
    from rbstab.sweep.sweep import sweep_to_folder
    from rbstab_cli.output.sweeps.sweep_answers import prove_and_tell
    from rbstab_cli.sweep_run import run_task

    def after(sweep: "Sweep") -> "Answers":
        return prove_and_tell(plan, sweep, unlimited=bool(prove), quiet=quiet, as_json=as_json)

    with ExitStack() as stack:
        if cluster is not None:
            from rbstab_cli.arguments.cluster import connected_cluster

            pool = stack.enter_context(connected_cluster(cluster, plan.engine))
            options = replace(options, pool=pool)
        run_task(
            lambda on_event, stop: sweep_to_folder(plan, folder, options, on_event, stop),
            fail_fast=options.fail_fast,
            as_json=as_json,
            quiet=quiet,
            after=None if prove is False else after,
        )


BESIDE_STATUS = ("plan", "status_of", "as_json", "quiet")
"""The parameters that may be given together with --status."""


def _refuse_beside_status(context: click.Context) -> None:
    """End the command with exit code 2 if an option is given that --status does not use."""
    unused = [
        parameter.opts[0]
        for parameter in context.command.params
        if parameter.name not in BESIDE_STATUS
        and context.get_parameter_source(parameter.name or "") is ParameterSource.COMMANDLINE
    ]
    if unused:
        raise click.UsageError(f"--status runs nothing, so it has no use for {', '.join(unused)}")


def _refuse_together(given: dict[str, object], first: str, *others: str) -> None:
    """End the command with exit code 2 if the first option is given with one of the others."""
    for other in others:
        if given[first] and given[other]:
            raise click.UsageError(f"{first} cannot be combined with {other}")
