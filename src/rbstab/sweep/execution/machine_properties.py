"""Machine properties that affect result bits: library versions and processor type."""

import platform
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

from rbstab.experiment.provenance import PACKAGES, commit

CPU_INFO = Path("/proc/cpuinfo")


def versions(engine: str) -> dict[str, str]:
    """Return the versions of rbstab and of all packages that affect the results of an engine."""
    names = sorted({*PACKAGES[engine], *PACKAGES["scipy"]})
    found = {"rbstab": version("rbstab"), "its commit": commit()}
    return found | {name: import_module(name).__version__ for name in names}


def difference(ours: dict[str, str], theirs: dict[str, str]) -> str:
    """Return the versions that differ, as text; an empty text if all are equal.

    If rbstab was installed from a package, it has no commit, and commits are not compared.
    """
    return ", ".join(
        f"{name} {theirs.get(name, '?')}, not {ours[name]}"
        for name in ours
        if ours[name] != theirs.get(name) and ours[name] and theirs.get(name, "?")
    )


def processor() -> str:
    """Return the name of this machine's processor type."""
    try:
        lines = CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, "") or platform.processor() or platform.machine()
