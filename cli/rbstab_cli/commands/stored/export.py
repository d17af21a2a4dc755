"""`rbstab export`."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.results import results_among, with_folders

if TYPE_CHECKING:
    from rbstab.report.reading.sources import Run, Sources
    from rbstab.store.variables import FlatColumns


@click.command("export")
@click.argument(
    "results", nargs=-1, required=True, metavar="RESULT...", type=click.Path(path_type=Path)
)
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="File of the table: .csv, .mat (MATLAB), .parquet, which needs pandas and pyarrow, or, "
    "of a sweep, .nc (netCDF-4).",
)
@click.option("--traces", is_flag=True, help="Write the motions: one row a sample.")
@click.option("--force", is_flag=True, help="Replace FILE if it exists.")
def command(results: tuple[Path, ...], output: Path, traces: bool, force: bool) -> None:
    """Write runs, or a sweep, as a table for other programs.

    Of runs the table has one row a run: what `rbstab show --json` prints of it, its settling time
    and its final state. Of a sweep it has one row a member: the varied values and the outcomes.
    RESULT may be a folder of runs.

    Vectors are split into columns: position_0, position_1, position_2. Units are SI, angles
    radians. What is not known is nan. With --traces, the table has one row a sample: of all runs,
    or of the members of the sweep whose traces are stored.
    """
    from rbstab.listing.table_files import FORMS, NETCDF, check_packages, form_of, write_columns
    from rbstab.report.reading.sources import read_sources
    from rbstab.store.errors import StoreError
    from rbstab_cli.output.text_file import check_target

    form = form_of(output)
    if form is None:
        endings = ", ".join(f".{ending}" for ending in (*FORMS, NETCDF))
        raise click.UsageError(f"-o {output}: expected a file name that ends in {endings}")
    try:
        check_packages(form)
    except ImportError as error:
        raise click.UsageError(f"-o {output}: {error}") from error
    check_target(output, force=force)
    sources = read_sources(with_folders(results_among(results)).paths)
    for unread in sources.unread:
        click.echo(f"{unread.path}: {unread.reason}", err=True)
    if sources.unread:
        raise click.exceptions.Exit(exit_codes.STORAGE)
    try:
        if form == NETCDF:
            rows, count = _write_netcdf(output, sources, traces=traces)
        else:
            columns = _columns(sources, traces=traces)
            write_columns(output, columns, form, replace=force)
            rows, count = len(next(iter(columns.arrays.values()))), len(columns.arrays)
    except (OSError, StoreError) as error:
        click.echo(f"error: {getattr(error, 'strerror', None) or error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    except (LookupError, ValueError, TypeError, ArithmeticError, AttributeError) as error:
        # Anybody may have written the file.
        reason = f"{type(error).__name__}: {error}"
        click.echo(f"error: a result has wrong content ({reason})", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    click.echo(f"-> {output}: {rows} row{'s' * (rows != 1)}, {count} columns")


def _write_netcdf(output: Path, sources: "Sources", *, traces: bool) -> tuple[int, int]:
    """Write a sweep as one netCDF-4 file, with the arrays as `open_sweep` returns them.

    Returns:
        The numbers of members and of columns.
    """
    from rbstab.listing.opening import open_sweep
    from rbstab.store.dataset_file import write_dataset

    if traces or sources.runs or len(sources.sweeps) != 1:
        raise click.UsageError(
            f"-o {output}: expected one sweep, without --traces. The files of runs, and those in "
            "the folder `traces` of a sweep, are netCDF-4 as they are"
        )
    table = open_sweep(sources.sweeps[0].path)
    whole = replace(table, kind="the exported table of a sweep")
    write_dataset(output, whole, replace=True)
    return len(table["run"]), len(table.columns)


def _columns(sources: "Sources", *, traces: bool) -> "FlatColumns":
    """Return the table of some runs, or of one sweep.

    Raises:
        StoreError: The traces of the sweep cannot be read.
    """
    from rbstab.listing.opening import open_sweep
    from rbstab.store.variables import flat_columns, joined
    from rbstab.sweep.folder.stored_traces import open_traces

    if not sources.sweeps:
        return joined([_of_run(run, traces=traces) for run in sources.runs])
    if len(sources.sweeps) > 1 or sources.runs:
        raise click.UsageError("expected runs only, or one sweep: they have other columns")
    file = sources.sweeps[0].path
    if not traces:
        return open_sweep(file).flat()
    return joined(
        [flat_columns(motions.variables, ("run", "time")) for motions in open_traces(file.parent)]
    )


def _of_run(run: "Run", *, traces: bool) -> "FlatColumns":
    """Return the samples of a run, or one row about it, below the name of its file."""
    import numpy as np

    from rbstab.experiment.convergence.with_proof import known_now
    from rbstab.experiment.own_states import final_state
    from rbstab.store.variables import FlatColumns, flat_columns
    from rbstab_cli.output.facts import run_data

    if traces:
        arrays, units = flat_columns(run.result.variables, ("time",))
        file = np.full(len(arrays["time"]), str(run.path), dtype=object)
        return FlatColumns({"file": file, **arrays}, units)
    known = known_now(run.path, run.result, run.config)
    data = {
        "file": str(run.path),
        **run_data(known.result, known.config, known.proof),
        "settling_time": run.settling_time,
        "final": final_state(run.result),
    }
    entries = dict(_entries("", data))
    arrays = {
        name: np.array([value], dtype=object if isinstance(value, str) else None)
        for name, value in entries.items()
    }
    return FlatColumns(arrays, {})


def _entries(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the numbers and texts in plain data, with names as `convergence_time`."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            yield from _entries(f"{name}_{key}".strip("_"), entry)
    elif isinstance(value, list | tuple):
        if all(isinstance(entry, str) for entry in value):
            yield name, "; ".join(value)
            return
        for number, entry in enumerate(value):
            yield from _entries(f"{name}_{number}", entry)
    else:
        yield name, float("nan") if value is None else value
