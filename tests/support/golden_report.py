"""What a report says of fixed runs, as plain numbers and words; `python -m` writes the golden file.

    PYTHONPATH=tests python -m support.golden_report

Write it again only where what is said changes on purpose.
"""

import json
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rbstab.report.build import report_of
from rbstab.report.model.document import Cards, Table
from rbstab.report.reading.sources import read_sources

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "data" / "golden" / "report_of_runs.json"

PROVED = ("paper/*.yaml", "examples/ligament_proved.yaml")
"""Configs whose proofs take a second or less each."""

COMPUTED = (
    *("examples/stop.yaml", "examples/elements.yaml", "examples/driven.yaml"),
    *("examples/joint.yaml", "examples/free_gravity.yaml", "examples/sliding_ties.yaml"),
)
"""Configs that are run without a proof, so that no time limit decides what is said."""

TIMES = re.compile(r", \d+ steps, [\d.]+ s$")
"""The end of a sentence that differs from run to run."""


def make(folder):
    """Run all configs and return the files of their results."""
    for name, patterns, more in (("proved", PROVED, []), ("computed", COMPUTED, ["--no-prove"])):
        configs = [str(path) for p in patterns for path in sorted((ROOT / "configs").glob(p))]
        code = "from rbstab_cli.main import cli; cli()"
        command = [sys.executable, "-c", code, "run", *configs, *more, "-o", str(folder / name)]
        subprocess.run(command, check=True, capture_output=True)
    return sorted(folder.glob("*/*.h5"))


def said_of(paths):
    """Return what a report of each run says, by the name of the run."""
    return {path.stem: _said(report_of(read_sources([path]), "")) for path in paths}


def _said(report):
    blocks = [block for section in report.sections for block in section.blocks]
    said: dict[str, Any] = {}
    for block in blocks:
        if isinstance(block, Cards):
            (card,) = block.cards
            said |= {
                statement.question: f"{statement.word}. {statement.sentence}"
                for statement in card.statements
            }
            said |= dict(card.facts)
            said["alarm"] = card.alarm
        elif isinstance(block, Table) and block.name == "runs":
            (row,) = block.rows
            for head, cell in zip(block.heads, row, strict=True):
                said[head.text] = cell.text if cell.value is None else cell.value
        elif isinstance(block, Table) and block.name in ("reference", "convergence", "warnings"):
            said[block.name] = [[TIMES.sub("", cell.text) for cell in row] for row in block.rows]
    return said


if __name__ == "__main__":
    with TemporaryDirectory() as name:
        content = said_of(make(Path(name)))
    GOLDEN.parent.mkdir(exist_ok=True)
    text = json.dumps(content, ensure_ascii=False, indent=1, sort_keys=True)
    GOLDEN.write_text(f"{text}\n", encoding="utf-8")
