"""Wall time of `rbstab report` as a whole process: of a thousand runs, and of a million members."""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import yaml

from benchmarks.measure import line, seconds_of
from benchmarks.swept import CASE

RBSTAB = [sys.executable, "-m", "rbstab_cli"]
LIMIT = "at most 10"

RUNS = 1_000
MEMBERS = 1_000_000

SPINS = [f"initial.angular_velocity[{axis}]" for axis in (0, 1)]
GAINS = [f"controller.{name}" for name in ("K_t", "L_t", "K_r", "L_r", "K_c", "L_c")]

PLANS: dict[str, dict[str, Any]] = {
    "a map of two spins": {
        "vary": {key: {"linspace": [-40, 40, 1000]} for key in SPINS},
        "design": "grid",
    },
    "six gains, each within 30 %": {
        "vary": {key: {"scale": {"uniform": [0.7, 1.3]}} for key in GAINS},
        "design": "random",
        "members": MEMBERS,
        "seed": 1,
    },
    "four conditions, two spins": {
        "vary": {"controller.K_r": {"each": {"scale": {"values": [0.5, 1, 2, 4]}}}}
        | {key: {"uniform": [-10, 10]} for key in SPINS},
        "design": "random",
        "members": MEMBERS // 4,
        "seed": 1,
    },
}


def _variants() -> dict[str, Any]:
    """Return the plan of the packaged sweep of variants, without the sliding one, which is slow."""
    plan: dict[str, Any] = yaml.safe_load(Path("configs/sweeps/variants.yaml").read_text())
    variants = plan["vary"]["controller.variant"]["each"]["values"]
    variants.remove("sliding")
    return plan | {"members": MEMBERS // len(variants), "keep": "summary"}


def main() -> None:
    """Measure reports of visco-elastic runs and members, and of several variants."""
    with tempfile.TemporaryDirectory(dir="results") as folder:
        _runs(Path(folder))
    for what, plan in (PLANS | {"four variants, nine numbers of the start": _variants()}).items():
        with tempfile.TemporaryDirectory(dir="results") as folder:
            _members(what, plan, Path(folder))


def _runs(folder: Path) -> None:
    base = yaml.safe_load(Path(CASE).read_text())
    for number in range(RUNS):
        base["initial"]["angular_velocity"] = [number / RUNS * 20, 5.0, -5.0]
        (folder / f"run{number:04}.yaml").write_text(json.dumps(base))
    configs = sorted(map(str, folder.glob("*.yaml")))
    seconds_of([*RBSTAB, "run", "--no-prove", *configs, "-o", str(folder), "-q"])
    seconds = _report(sorted(map(str, folder.glob("*.h5"))), folder)
    line(f"rbstab report of {RUNS} runs", seconds, "s", LIMIT)


def _members(what: str, plan: dict[str, Any], folder: Path) -> None:
    (folder / "plan.yaml").write_text(json.dumps({"base": str(Path(CASE).resolve())} | plan))
    seconds_of([*RBSTAB, "sweep", str(folder / "plan.yaml"), "-o", str(folder), "-q"])
    seconds = _report([str(folder / "plan")], folder)
    line(f"rbstab report of {MEMBERS} members: {what}", seconds, "s", LIMIT)


def _report(results: list[str], folder: Path) -> float:
    words = [*RBSTAB, "report", *results, "-o", str(folder / "report.html"), "--force", "-q"]
    return min(seconds_of(words) for _ in range(3))


if __name__ == "__main__":
    main()
