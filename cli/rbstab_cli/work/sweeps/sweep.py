"""`rbstab sweep`: the checks before a sweep, and its options."""

from dataclasses import replace
from pathlib import Path

import click

from rbstab.sweep.folder.open_folder import parse_part
from rbstab.sweep.folder.sweep_folder import engine_of
from rbstab.sweep.members.engines import factory_for, fastest_engine
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.plan import Plan
from rbstab_cli.inputs import (
    is_in_sweep_folder,
    load_plans,
    print_warnings,
    refuse_engine_change,
    sweep_name,
)
from rbstab_cli.output.files import check_proofs_folder, check_results_folder
from rbstab_cli.printing import say
from rbstab_cli.work.sweeps.tables import report_dry_run, report_status

WITHOUT_HEYOKA = "heyoka is not installed: using scipy, which is much slower"


def sweep(
    plan: Path | None,
    status_of: Path | None,
    output: Path,
    changes: tuple[str, ...],
    engine: str | None,
    threads: int | None,
    shard_size: int | None,
    part: str | None,
    dask: str | None,
    dry_run: bool,
    retry_failed: bool,
    fail_fast: bool,
    compare: int | None,
    prove: bool | None,
    force: bool,
    allow_python: bool,
    as_json: bool,
) -> int | None:
    """Run a plan, or print the status of a sweep."""
    if status_of is not None:
        report_status(status_of, as_json=as_json)
        return None
    if plan is None:
        raise click.UsageError("expected PLAN or --status DIR")
    try:
        parsed_part = None if part is None else parse_part(part)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--part'") from error
    folder = output / sweep_name(plan)
    refuse_engine_change(changes)
    name, is_slow = _engine(engine, folder, plan)
    loaded = _load(plan, (*changes, f"integration.engine={name}"), allow_python=allow_python)
    proves = prove is not False and loaded.prove is None
    if check_results_folder(output, [folder]) and proves and not (dry_run or part):
        check_proofs_folder(output)
    if is_slow:
        say(WITHOUT_HEYOKA)
    options = SweepOptions(
        None, threads, shard_size, retry_failed, fail_fast, force, parsed_part, compare=compare
    )
    if dry_run:
        report_dry_run(loaded, folder, options, as_json=as_json)
        return None
    # Imported late: checks need none of what runs members.
    from rbstab_cli.work.sweeps.cluster import connected_cluster
    from rbstab_cli.work.sweeps.running import run_sweep

    unlimited = bool(prove) if proves else None
    with connected_cluster(dask, loaded.engine) as pool:
        options = replace(options, pool=pool)
        return run_sweep(loaded, folder, options, unlimited=unlimited, as_json=as_json)


def _engine(wanted: str | None, folder: Path, plan: Path) -> tuple[str, bool]:
    """Return the engine, and whether it is slow because heyoka is not installed."""
    # The wanted one, or the one of the stored sweep, or the fastest.
    name = wanted or engine_of(folder)
    if name is None and is_in_sweep_folder(plan):
        name = engine_of(plan.parent)
    is_slow = name is None and fastest_engine() == "scipy"
    name = name or fastest_engine()
    # Refuses an engine that is not installed.
    factory_for(name)
    return name, is_slow


def _load(path: Path, changes: tuple[str, ...], *, allow_python: bool) -> Plan:
    """Load a plan, or end the command with all its errors; print its warnings."""
    plan = load_plans([path], lambda _: changes, allow_python=allow_python)[path]
    print_warnings((str(path), base) for base in plan.bases.values())
    return plan
