"""Protects `rbstab stability --within` and `--largest-within`."""

import json
from pathlib import Path

import pytest
from cli.conftest import GOOD, rbstab, success

HELD = GOOD.replace("A short run", "A held body").replace("variant: free", "variant: permanent")


@pytest.fixture
def held(folder):
    """The config `held.yaml` in the working folder."""
    (folder / "held.yaml").write_text(HELD)
    return folder


def test_the_proof_is_printed_first_and_stored(held):
    arguments = ("stability", "held.yaml", "--no-run", "--within", "controller=±20%")
    done = success(*arguments, "--within", "body.contact_point=±0.01")
    title, _, first, second, *rest = done.stdout.splitlines()
    assert title == "held.yaml: A held body"
    within = "For every body within controller ±20 %, body.contact_point ±0.01: "
    assert first.startswith(f"  {within}one rest state, a minimum, proved (")
    assert second.startswith(f"  {within}every motion with v(0) < 76")
    assert second.endswith(" J converges, proved.")
    assert any(line.startswith("  Rest states: 1 rest state") for line in rest)
    files = sorted(path.name for path in (held / "results" / "proofs").iterdir())
    assert len([name for name in files if name.startswith("within-")]) == 1
    again = rbstab(*arguments, "--within", "body.contact_point=±0.01", "--json")
    ((facts,), proof) = (answers := json.loads(again.stdout)), answers[0]["within"]["proof"]
    assert facts["within"]["tolerances"] == ["controller=±20%", "body.contact_point=±0.01"]
    assert proof["proved"] is True
    gains = {
        tolerance["key"]: (tolerance["low"], tolerance["high"]) for tolerance in proof["tolerances"]
    }
    assert gains["controller.K_r[0]"] == ("320", "480")
    assert 760 <= proof["level"] < 770


@pytest.mark.slow
def test_largest_is_bracketed(held):
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


def test_a_sliding_connector_is_not_decided(held):
    text = HELD.replace("variant: permanent", "variant: sliding\n  K_s: [60, 60, 40]")
    (held / "sliding.yaml").write_text(text.replace("K_s", "surface: position\n  K_s"))
    done = rbstab("stability", "sliding.yaml", "--no-run", "--within", "controller.K_r=±1%")
    assert (
        "not decided (the energy has no form that can be bounded: the energy K_s|E|" in done.output
    )


def test_a_limit_of_time_ends_the_proof_and_is_told(held):
    """Nothing that ended early is kept as the answer: with more time, it is proved."""
    within = ("stability", "held.yaml", "--no-run", "--within", "controller.K_r=±1%")
    done = success(*within, "--time-limit", "1e-9")
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


FAST = ("--set", "initial.angular_velocity=[12,0,0]")
"""A start above the level of the certified region."""

SPIN = "initial.angular_velocity[0]=±0.01"


def test_every_start_is_proved_and_the_proof_is_stored(folder):
    arguments = ("stability", "good.yaml", *FAST, "--no-run", "--within", SPIN)
    first = success(*arguments)
    (line,) = [row for row in first.stdout.splitlines() if "For every start within" in row]
    assert "initial.angular_velocity[0] ±0.01: the motion converges to rest state 1, proved" in line
    assert "inside the certified region from t = " in line
    (stored,) = (folder / "results" / "proofs").glob("starts-*.json")
    before = stored.stat().st_mtime_ns
    again = rbstab(*arguments, "--json")
    assert stored.stat().st_mtime_ns == before
    starts = json.loads(again.stdout)[0]["within"]["starts"]
    assert starts["proved"] is True
    assert starts["rest_states"] == [1]
    assert starts["tolerances"] == [
        {"key": "initial.angular_velocity[0]", "low": "11.99", "high": "12.01"}
    ]
