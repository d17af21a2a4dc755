"""`rbstab export`."""

from typing import Any

from rbstab_cli.options import PATH, declare, flag, output, takes


@declare("export", "rbstab export results/sweep -o sweep.csv")
@takes("results")
@output(
    "File of the table: .csv, .mat (MATLAB), .parquet, which needs pandas and pyarrow, or, of a "
    "sweep, .nc (netCDF-4); default results.csv.",
    PATH,
    default="results.csv",
)
@flag("--traces", help="Write the motions: one row a sample.")
@takes("force")
def command(**given: Any) -> None:
    """Write runs, or a sweep, as a table for other programs.

    Of runs the table has one row a run: what `rbstab show --json` prints of it, its settling time
    and its final state. Of a sweep it has one row a member: the varied values and the outcomes.
    RESULT may be a folder of runs, by default results.

    Vectors are split into columns: position_0, position_1, position_2. Units are SI, angles
    radians. What is not known is nan. With --traces, the table has one row a sample: of all runs,
    or of the members of the sweep whose traces are stored.
    """
    from rbstab_cli.work.stored.export import export

    export(**given)
