"""Wall time of commands as whole processes."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measure import by_turns, line, python, seconds_of

RBSTAB = [sys.executable, "-m", "rbstab_cli"]
CASE = "configs/paper/case1_permanent.yaml"


def main() -> None:
    """Measure `rbstab --help`, and `rbstab run` on Case 1 and on all configs of the paper."""
    interpreter, plain_help = by_turns(
        11, lambda: seconds_of(python("pass")), lambda: seconds_of([*RBSTAB, "--help"])
    )
    line("rbstab --help, whole process", plain_help, "s", "at most 0.15")
    line("  the interpreter's own start", interpreter, "s", "")
    with tempfile.TemporaryDirectory() as folder:
        _run_of_case(Path(folder))
        _run_of_all(Path(folder))


def _run_of_case(folder: Path) -> None:
    integrations: list[float] = []

    def whole() -> float:
        command = [*RBSTAB, "run", "--no-prove", CASE, "-o", str(folder), "--force", "--json", "-q"]
        begin = time.perf_counter()
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        seconds = time.perf_counter() - begin
        integrations.append(json.loads(done.stdout)[0]["wall_time"])
        return seconds

    def imports() -> float:
        return seconds_of(python("import scipy.integrate, h5py"))

    process, importing = by_turns(9, whole, imports)
    integration = sorted(integrations)[len(integrations) // 2]
    line("rbstab run on Case 1, whole process", process, "s", "")
    line("  importing scipy.integrate and h5py", importing, "s", "")
    line("  the integration itself", integration, "s", "")
    line("  ratio to importing scipy.integrate and h5py", process / importing, "", "at most 1.7")
    line("  ratio to the sum of the two", process / (importing + integration), "", "at most 1.5")


def _run_of_all(folder: Path) -> None:
    """Time one command for all configs of the paper: the imports are shared."""
    configs = sorted(str(path) for path in Path("configs/paper").glob("*.yaml"))
    whole = seconds_of([*RBSTAB, "run", "--no-prove", *configs, "-o", str(folder), "--force", "-q"])
    line(f"rbstab run on the {len(configs)} configs of the paper", whole, "s", "")
