"""Provenance of a result: versions, commit and time."""

import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

PACKAGES = {"scipy": ("numpy", "scipy"), "heyoka": ("numpy", "heyoka")}
"""The packages that compute the numbers of each engine."""


_HEAD = "# branch.oid "
_NO_COMMIT = "(initial)"
"""What git says of its current commit, and of a repository that has none."""


def provenance(engine: str) -> dict[str, str]:
    """Return versions, commit and time of creation, as attributes of a result."""
    versions = {f"{name}_version": import_module(name).__version__ for name in PACKAGES[engine]}
    return {
        "rbstab_version": version("rbstab"),
        "commit": commit(),
        "python_version": platform.python_version(),
        **versions,
        "h5py_version": version("h5py"),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


@cache
def commit() -> str:
    """Return the git commit of the program, with "+" if its code was changed since.

    It is found once for all runs of a process, which keeps the code that it has imported.

    Returns:
        The commit; "" if the program was installed from a package.
    """
    source = Path(__file__).resolve().parents[1]
    checkout = source.parent.parent
    if not (checkout / ".git").exists() or source.parent.name != "src":
        return ""
    # One call of git tells both: it takes as long as a tenth of a short run.
    options = ("--porcelain=v2", "--branch", "--no-ahead-behind", "--untracked-files=no")
    lines = _git(checkout, "status", *options, "--", "src", "cli").splitlines()
    head = next((line.removeprefix(_HEAD) for line in lines if line.startswith(_HEAD)), "")
    if head == _NO_COMMIT:
        return ""
    changed = any(not line.startswith("#") for line in lines)
    return head + "+" if head and changed else head


def _git(checkout: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", "-C", str(checkout), *arguments],
            capture_output=True,
            # Names of branches are UTF-8 on every system.
            encoding="utf-8",
            errors="replace",
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
