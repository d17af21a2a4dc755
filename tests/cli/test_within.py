"""Protects `rbstab stability --within` and `--largest-within`."""

import json
from pathlib import Path

import pytest
from cli.conftest import Invoke

HELD = """\
title: A held body
body: {mass: 41, inertia: [10.0, 9.0, 2.0], contact_point: [0.15, 0.10, -0.42]}
controller:
  variant: permanent
  K_t: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [400, 400, 320]
  L_r: [60, 60, 42]
initial: {angular_velocity: [1, 2, -1]}
integration: {duration: 0.1, samples: 11}
"""


@pytest.fixture
def held(folder: Path) -> Path:
    """The config `held.yaml` in the working folder."""
    (folder / "held.yaml").write_text(HELD)
    return folder


def test_the_proof_is_printed_first_and_stored(held: Path, rbstab: Invoke) -> None:
    arguments = ("stability", "held.yaml", "--no-run", "--within", "controller=±20%")
    done = rbstab(*arguments, "--within", "body.contact_point=±0.01")
    assert done.exit_code == 0
    title, _, first, second, *rest = done.stdout.splitlines()
    assert title == "held.yaml: A held body"
    within = "For every body within controller ±20 %, body.contact_point ±0.01: "
    assert first.startswith(f"  {within}one rest state, a minimum, proved (")
    assert second.startswith(f"  {within}every motion with v(0) < 76")
    assert second.endswith(" J converges, proved.")
    assert any(line.startswith("  Rest states: 1 rest state") for line in rest)
    files = sorted(path.name for path in (held / "results" / "proofs").iterdir())
    assert len([name for name in files if name.startswith("within-")]) == 1
    again = rbstab(*arguments, "--within", "body.contact_point=±0.01")
    assert again.stdout == done.stdout


def test_json_has_all_of_it(held: Path, rbstab: Invoke) -> None:
    arguments = ("stability", "held.yaml", "--no-run", "--json")
    (facts,) = json.loads(rbstab(*arguments, "--within", "controller.K_r=±5%").stdout)
    within = facts["within"]
    proof = within["proof"]
    assert within["tolerances"] == ["controller.K_r=±5%"]
    assert proof["proved"] is True
    assert proof["tolerances"][0] == {"key": "controller.K_r[0]", "low": "380", "high": "420"}
    assert 0 < proof["level"] < 1020
    assert (proof["parts"], within["largest"]) == (1, [])
    assert proof["boxes"] > 100
    (without,) = json.loads(rbstab(*arguments).stdout)
    assert without["within"] is None


@pytest.mark.slow
def test_largest_is_bracketed(held: Path, rbstab: Invoke) -> None:
    """K_r alone: there is a second rest state at 0.3 of it, so the answer is below 70 %."""
    key = "controller.K_r"
    arguments = ("stability", "held.yaml", "--no-run", "--json", "--time-limit", "600")
    done = rbstab(*arguments, "--largest-within", key)
    (facts,) = json.loads(done.stdout)
    (largest,) = facts["within"]["largest"]
    assert facts["within"]["proof"] is None
    assert largest["key"] == "controller.K_r"
    assert 30 < float(largest["percent"]) < float(largest["not_proved_percent"]) <= 70
    assert largest["proof"]["proved"] is True
    assert largest["not_proved"]["proved"] is not True
    head = f"Largest tolerance of controller.K_r: ±{largest['percent']} %, proved."
    assert facts["within"]["statements"][0].startswith(head)


def test_a_sliding_connector_is_not_decided(held: Path, rbstab: Invoke) -> None:
    text = HELD.replace("variant: permanent", "variant: sliding\n  K_s: [60, 60, 40]")
    (held / "sliding.yaml").write_text(text.replace("K_s", "surface: position\n  K_s"))
    done = rbstab("stability", "sliding.yaml", "--no-run", "--within", "controller.K_r=±1%")
    assert (
        "not decided (the energy has no form that can be bounded: the energy K_s|E|" in done.output
    )


def test_a_proof_that_cannot_be_stored_is_printed(held: Path, rbstab: Invoke) -> None:
    (held / "results").mkdir()
    (held / "results" / "proofs").write_text("in the way")
    done = rbstab("stability", "held.yaml", "--no-run", "--within", "controller.K_r=±1%")
    assert done.exit_code == 0
    assert "one rest state, a minimum, proved" in done.stdout
    assert "the proof is not stored" in done.stderr


def test_a_limit_of_time_ends_the_proof_and_is_told(held: Path, rbstab: Invoke) -> None:
    """Nothing that ended early is kept as the answer: with more time, it is proved."""
    within = ("stability", "held.yaml", "--no-run", "--within", "controller.K_r=±1%")
    done = rbstab(*within, "--time-limit", "1e-9")
    assert done.exit_code == 0
    first = done.stdout.splitlines()[2]
    assert "not decided (the time limit was reached: 1 of 1 parts are not proved)" in first
    assert "one rest state, a minimum, proved" in rbstab(*within).stdout
    starts = ("stability", "held.yaml", "--no-run", "--within", "initial.angular_velocity[0]=±0.1")
    done = rbstab(*starts, "--time-limit", "1e-9")
    assert "convergence is not decided; the time limit was reached." in done.stdout
    assert not list(Path("results/proofs").glob("starts-*"))
    largest = rbstab(
        *("stability", "held.yaml", "--no-run", "--largest-within", "controller"),
        *("--time-limit", "1e-9"),
    )
    assert "found by the time limit: none is proved." in largest.stdout
    assert rbstab(*within, "--time-limit", "0").exit_code == 2
