"""Which sweep a plan on the command line is of."""

from pathlib import Path


def sweep_name(path: Path) -> str:
    """The name of the sweep of a plan: that of the file, or of the folder that it belongs to."""
    return path.absolute().parent.name if is_of_a_sweep(path) else path.stem


def is_of_a_sweep(path: Path) -> bool:
    """Whether a plan is the one that the folder of a sweep has within itself.

    Such a plan has the engine of its sweep.
    """
    from rbstab.sweep.folder.sweep_folder import MANIFEST, PLAN_FILE

    return path.name == PLAN_FILE and (path.parent / MANIFEST).is_file()
