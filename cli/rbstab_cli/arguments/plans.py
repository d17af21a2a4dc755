"""The name of the sweep of a plan on the command line."""

from pathlib import Path


def sweep_name(path: Path) -> str:
    """Return the name of a plan's sweep: the stem of its file, or the name of its sweep folder."""
    return path.absolute().parent.name if is_in_sweep_folder(path) else path.stem


def is_in_sweep_folder(path: Path) -> bool:
    """Whether a plan is the copy in the folder of its sweep; this copy names its engine."""
    from rbstab.sweep.folder.manifest import MANIFEST
    from rbstab.sweep.folder.sweep_folder import PLAN_FILE

    return path.name == PLAN_FILE and (path.parent / MANIFEST).is_file()
