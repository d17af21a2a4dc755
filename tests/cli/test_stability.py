"""Protects `rbstab stability` and `rbstab run --prove`: proofs, verdicts, and stored proofs."""

import json
from pathlib import Path

import pytest
from cli.conftest import Invoke

WEAK = "controller.K_r=[40,40,32]"


def test_what_is_said_of_a_good_config(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("stability", "good.yaml")
    assert done.exit_code == 0
    text = done.stdout
    assert text.startswith("good.yaml: A short run\n")
    assert "1 rest state in the range: 1 stable; proved to be all" in text
    assert "Globally stable: proved. Every motion that stays in the range, and keeps a " in text
    assert ", inside; convergence is proved" in text
    assert "Checks of the computed run: seen." in text
    for word in ("stable", "ζ", "derivative", "certified region"):
        assert word in text
    assert len(list((folder / "results" / "proofs").iterdir())) == 1


def test_json_has_all_of_it(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("stability", "good.yaml", "--json", "--along", "controller.K_r=0.5:2:3")
    (facts,) = json.loads(done.stdout)
    assert facts["proved"] is True
    assert facts["unique"] is True
    assert facts["inside"] is True
    (state,) = facts["states"]
    assert state["index"] == 0
    assert state["orientation"] == pytest.approx([0, 0, 0], abs=1e-9)
    # The least damped mode of the free body: m ẍ + L ẋ + K x = 0 along the third axis.
    frequencies = [mode["natural_frequency"] for mode in state["modes"]]
    assert any(f == pytest.approx((3280 / 41) ** 0.5) for f in frequencies)
    assert facts["certificate"]["verdict"] == "consistent"
    assert [line["check"] for line in facts["certificate"]["lines"]][-1] == "certified region"
    (along,) = facts["along"]
    assert [point["factor"] for point in along["points"]] == pytest.approx([0.5, 1, 2])
    assert len(along["points"][0]["eigenvalues"]) == 12


def test_a_counterexample_is_named(folder: Path, rbstab: Invoke) -> None:
    text = Path("good.yaml").read_text().replace("variant: free", "variant: permanent")
    text = text.replace("initial:", "initial: # spin\n ").replace("# spin\n  {", "{")
    Path("held.yaml").write_text(text.replace("inertia: [10.0, 9.0, 2.0]", "inertia: [10, 8, 3]"))
    done = rbstab("stability", "held.yaml", "--set", WEAK, "--no-run")
    assert done.exit_code == 0
    assert "3 rest states in the range: 1 stable, 2 unstable; proved to be all" in done.stdout
    assert "Almost every start: proved. Returns: almost every start" in done.stdout
    other = "the unstable rest state 2, Θ = (-1.33, 1.514, -2.447) rad"
    assert f"not every start; the body can also rest at {other}" in done.stdout
    assert "unstable, index 2" in done.stdout
    assert "Verdict" not in done.stdout


def test_run_prove_makes_the_proof(folder: Path, rbstab: Invoke) -> None:
    first = rbstab("run", "--no-prove", "good.yaml", "--json")
    assert json.loads(first.stdout)[0]["convergence"]["proved"] is None
    second = rbstab("run", "good.yaml", "--json", "--prove")
    facts = json.loads(second.stdout)[0]
    assert (facts["convergence"]["proved"], facts["computed"]) == (True, False)
    # It is used by every command, and made once.
    (kept,) = (folder / "results" / "proofs").iterdir()
    before = kept.stat().st_mtime_ns
    without = rbstab("run", "--no-prove", "good.yaml", "--json", "-o", "results", "--force")
    assert json.loads(without.stdout)[0]["convergence"]["proved"] is True
    search = ("stability", "good.yaml", "--search-only", "--no-run")
    found = rbstab(*search)
    assert "proved to be all" in found.stdout
    assert kept.stat().st_mtime_ns == before
    assert rbstab(*search, "-o", "stability.txt").stdout == ""
    assert Path("stability.txt").read_text() == found.stdout
    searched = rbstab(*search, "--results", "other").stdout
    assert "not proved to be all" in searched
    assert "from a search, not proved" in searched
    assert not Path("other").exists()


def test_a_folder_that_takes_no_proof_is_no_error(folder: Path, rbstab: Invoke) -> None:
    Path("results").mkdir()
    Path("results/proofs").write_text("a file")
    done = rbstab("stability", "good.yaml", "--no-run")
    assert done.exit_code == 0
    assert "the proof is not stored" in done.stderr
    assert "proved to be all" in done.stdout


def test_the_run_of_a_violated_argument_is_told(folder: Path, rbstab: Invoke) -> None:
    """Implicit steps this long violate the energy balance of v."""
    text = Path("good.yaml").read_text().replace("variant: free", "variant: sliding")
    law = "K_s: [20000, 20000, 20000]\n  surface: position\n  law: {implicit: 0.01}\n  K_t"
    text = text.replace("K_t", law).replace("[1, 2, -1]", "[16, 32, -16]")
    Path("coarse.yaml").write_text(text)
    done = rbstab("run", "--no-prove", "coarse.yaml")
    assert "the Lyapunov argument fails: audit: max |r| / largest energy: " in done.stderr
    assert " > 0.01\n" in done.stderr
    assert "This start:  not decided: the check audit of the computed run failed" in done.stdout
