"""`rbstab stability --within` with tolerances of the initial state: every start is proved."""

import json
from pathlib import Path

from cli.conftest import Invoke

FAST = ("--set", "initial.angular_velocity=[12,0,0]")
"""A start above the level of the certified region."""

SPIN = "initial.angular_velocity[0]=±0.01"


def test_every_start_is_proved_and_the_proof_is_stored(folder: Path, rbstab: Invoke) -> None:
    arguments = ("stability", "good.yaml", *FAST, "--no-run", "--within", SPIN)
    first = rbstab(*arguments)
    assert first.exit_code == 0, first.output
    (line,) = [one for one in first.stdout.splitlines() if "For every start within" in one]
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


def test_a_damaged_proof_is_made_again(folder: Path, rbstab: Invoke) -> None:
    arguments = ("stability", "good.yaml", *FAST, "--no-run", "--within", SPIN)
    rbstab(*arguments)
    (stored,) = (folder / "results" / "proofs").glob("starts-*.json")
    whole = stored.read_text()
    stored.write_text(whole.replace('"rest_state": 1', '"rest_state": 2'))
    done = rbstab(*arguments)
    assert done.exit_code == 0
    assert "converges to rest state 1, proved" in done.stdout
    assert '"rest_state": 1' in stored.read_text()
