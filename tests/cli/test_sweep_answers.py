"""`rbstab sweep` says unasked how many members are proved to converge, after it has stored them."""

from pathlib import Path

import pytest
from cli.conftest import Invoke

PLAN = """\
base: good.yaml
vary:
  initial.angular_velocity[1]: {values: [1, 2, 60]}
"""


@pytest.mark.usefixtures("plan")
def test_members_that_start_in_a_region(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("sweep", "plan.yaml")
    assert done.exit_code == 0, done.output
    *_, proved, not_proved = done.stdout.splitlines()
    assert proved == "Convergence: proved for 2 of the members: they start in a certified region."
    assert not_proved.startswith("Convergence: not proved for 1 of the members: they start outside")
    # So it is in the report, which makes no proofs.
    shown = rbstab("report", "results/plan", "--format", "text")
    assert "2 of 3 are proved to converge to a rest state" in " ".join(shown.stdout.split())


@pytest.mark.usefixtures("plan")
def test_nothing_is_proved_on_request(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("sweep", "plan.yaml", "--no-prove")
    assert "Convergence" not in done.stdout
    assert not (folder / "results/proofs").exists()


def test_members_with_bodies_of_their_own(folder: Path, rbstab: Invoke) -> None:
    Path("bodies.yaml").write_text("base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n")
    done = rbstab("sweep", "bodies.yaml")
    assert "Convergence: not proved; its members do not share one body" in done.stdout
    assert not (folder / "results/proofs").exists()


def test_members_that_no_theorem_decides(folder: Path, rbstab: Invoke) -> None:
    element = "{kind: ligament, point: [0, 0, 0.1], anchor: [0, 0, 0.4], stiffness: 100,"
    element += " slack_length: 0.2, toe_strain: 0.03}"
    text = Path("good.yaml").read_text().replace("title:", "schema_version: 2\ntitle:")
    Path("taut.yaml").write_text(f"{text}elements: {{line: {element}}}\n")
    vary = "vary:\n  initial.angular_velocity[1]: {values: [1, 2]}\n"
    Path("lines.yaml").write_text(f"base: taut.yaml\n{vary}")
    done = rbstab("sweep", "lines.yaml")
    assert done.exit_code == 0, done.output
    assert "Convergence: not proved; an element switches" in done.stdout
