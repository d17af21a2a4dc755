"""Interpreters of Python on this machine, by version: those that the hosted workflow tests."""

import os
import shutil
import subprocess
from pathlib import Path

import yaml

WORKFLOW = Path(__file__).parents[2] / ".github" / "workflows" / "tests.yml"


def workflow_versions() -> list[str]:
    """Return the versions in the workflow, such as `3.11`, the oldest first."""
    workflow = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))
    versions: list[str] = workflow["jobs"]["systems"]["strategy"]["matrix"]["python"]
    return sorted(versions, key=lambda version: [int(part) for part in version.split(".")])


def interpreter(version: str) -> str | None:
    """Return an interpreter of a version that works, on the path or of pyenv; None without one."""
    folder = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    found = sorted(folder.glob(f"{version}.*/bin/python{version}"))
    for path in filter(None, [shutil.which(f"python{version}"), *map(str, found)]):
        # What pyenv puts on the path fails for a version that is not chosen there.
        done = subprocess.run([path, "-c", "import venv"], capture_output=True, check=False)
        if done.returncode == 0:
            return path
    return None
