"""`rbstab export`: runs, or a sweep, as a table for other programs."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from rbstab.experiment.stored_run import final_state
from rbstab.listing.folder import checked_content
from rbstab.listing.opening import open_sweep
from rbstab.listing.table_files import FORMS, NETCDF, write_columns
from rbstab.report.model.words import counted
from rbstab.report.reading.sources import Run, Sources, read_sources
from rbstab.store.dataset_file import write_dataset
from rbstab.store.variables import FlatColumns, flat_columns, joined
from rbstab.sweep.folder.stored_traces import open_traces
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed, reason_of, require
from rbstab_cli.output.files import check_target, form_of
from rbstab_cli.output.runs import run_data
from rbstab_cli.results import taken


def export(results: tuple[Path, ...], output: Path, traces: bool, force: bool) -> None:
    """Write the table of some results.

    Args:
        results: The files and folders of the results.
        output: The file of the table; its ending gives the form.
        traces: Whether to write the motions, with a row for each sample.
        force: Whether an existing file is replaced.
    """
    form = form_of(output, (*FORMS, NETCDF))
    if form == "parquet":
        require("table", f"-o {output}", "pandas", "pyarrow")
    check_target(output, force=force)
    sources = read_sources(taken(results).paths)
    if sources.unread:
        lines = (f"{unread.path}: {unread.reason}" for unread in sources.unread)
        raise Failed(exit_codes.STORAGE, *lines)
    try:
        if form == NETCDF:
            rows, count = _write_netcdf(output, sources, traces=traces)
        else:
            columns = _columns(sources, traces=traces)
            write_columns(output, columns, form, replace=force)
            rows, count = len(next(iter(columns.arrays.values()))), len(columns.arrays)
    except OSError as error:
        raise Failed(exit_codes.STORAGE, f"error: {reason_of(error)}") from error
    click.echo(f"-> {output}: {counted(rows, 'row')}, {count} columns")


def _write_netcdf(output: Path, sources: Sources, *, traces: bool) -> tuple[int, int]:
    """Write a sweep as netCDF-4, as `open_sweep` returns it; count its members and columns."""
    if traces or sources.runs or len(sources.sweeps) != 1:
        raise click.UsageError(
            f"-o {output}: expected one sweep, without --traces. The files of runs, and those in "
            "the folder `traces` of a sweep, are netCDF-4 as they are"
        )
    table = open_sweep(sources.sweeps[0].path)
    whole = replace(table, kind="the exported table of a sweep")
    write_dataset(output, whole, replace=True)
    return len(table["run"]), len(table.columns)


def _columns(sources: Sources, *, traces: bool) -> FlatColumns:
    """Return the table of some runs, or of one sweep."""
    if not sources.sweeps:
        return joined([_of_run(run, traces=traces) for run in sources.runs])
    if len(sources.sweeps) > 1 or sources.runs:
        raise click.UsageError("expected runs only, or one sweep: they have other columns")
    file = sources.sweeps[0].path
    with checked_content(file):
        if not traces:
            return open_sweep(file).flat()
        motions = (
            flat_columns(motion.variables, ("run", "time")) for motion in open_traces(file.parent)
        )
        return joined(list(motions))


def _of_run(run: Run, *, traces: bool) -> FlatColumns:
    """Return the samples of a run, or one row about it, below the name of its file."""
    with checked_content(run.path):
        if traces:
            arrays, units = flat_columns(run.result.variables, ("time",))
            file = np.full(len(arrays["time"]), str(run.path), dtype=object)
            return FlatColumns({"file": file, **arrays}, units)
        data = {"file": str(run.path), **run_data(run), "final": final_state(run.result)}
        arrays = {
            name: np.array([value], dtype=object if isinstance(value, str) else None)
            for name, value in _entries("", data)
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
