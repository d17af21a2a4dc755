"""`rbstab run`: its file, table and answers; repeated, failed and forced runs; members."""

import json
from pathlib import Path

import pytest
from cli.conftest import GOOD, ended, json_of, rbstab, success
from support.printed_paths import printed, words_of

import rbstab as api
from rbstab.config.load import run_id
from rbstab.store.errors import StoreError
from rbstab.sweep.plan.load import load_plan

RUN = ("run", "good.yaml", "--no-prove")

OUTSIDE = ("--set", "controller.variant=permanent", "--set", "initial.angular_velocity=[16,32,-16]")


@pytest.mark.heavy
def test_proved_answers_come_last_and_are_proved_once(folder, refuse):
    done = success("run", "good.yaml", *OUTSIDE)
    head, *_, outcome, desired, this_start, whole_range, pushes, modes = done.stdout.splitlines()
    assert head.split()[:2] == ["file", "outcome"]
    assert outcome.startswith("  Outcome:     still moving at t = 0.1 s: at (")
    assert outcome.endswith("(the exact motion is proved to converge to (0°, 0°, 0°)): seen.")
    assert desired == "  Desired:     upright (default), within 10°."
    assert this_start.startswith("  This start:  proved: ")
    assert whole_range.startswith("  Whole range: proved: ")
    assert pushes.startswith("  Pushes:      proved: ")
    assert modes.startswith("  Modes:       natural frequencies ")
    stored = api.open_result("results/good.h5")
    assert stored.attributes["convergence"] == "proved"
    assert len(list(Path("results/proofs").iterdir())) == 1
    refuse("experiment.proof.prove", "experiment.convergence.exact_motion.prove_convergence")
    again = rbstab("run", "good.yaml", *OUTSIDE)
    assert (again.exit_code, again.stdout) == (0, done.stdout)
    assert "already done" in again.stderr
    (data,) = json_of("run", "good.yaml", *OUTSIDE)
    words = {question: answer["word"] for question, answer in data["answers"].items()}
    assert words == dict.fromkeys(("this_start", "whole_range", "pushes"), "proved")
    assert (data["outcome"]["kind"], data["outcome"]["rest_state"]) == ("moving", 1)
    shown = json_of("show", "results/good.h5")
    assert [shown[key] for key in ("answers", "outcome")] == [data["answers"], data["outcome"]]


@pytest.mark.slow
def test_a_run_leaves_a_file_a_table_and_facts(folder):
    done = rbstab(*RUN)
    result = api.open_result("results/good.h5")
    assert (done.exit_code, result.status) == (0, "completed")
    header, line = done.stdout.splitlines()[:2]
    assert header.split()[:2] == ["file", "outcome"]
    assert line.split()[:2] == [printed("results/good.h5"), "still"]
    # The motion is not at rest after 0.1 s.
    assert line.split()[7] == "-"
    assert "At rest: v stays below v(0)/1000 from then on; -: not in this run." in done.stdout
    assert "  This start:  not decided: the Lyapunov function v fell" in done.stdout
    assert "  Whole range: not decided: " in done.stdout
    assert "is stored; the same command with --prove tries to make it." in done.stdout
    assert not Path("results/proofs").exists()
    facts_of = rbstab(*RUN, "--json", "-o", "elsewhere")
    (facts,) = json.loads(facts_of.stdout)
    assert facts["file"] == printed("elsewhere/good.h5")
    assert facts["run_id"] == result.run_id
    assert facts["lyapunov_start"] == result["lyapunov"][0]
    assert (facts["end_time"], facts["warnings"], facts["computed"]) == (0.1, [], True)
    assert facts["convergence"]["proved"] is None
    assert "rbstab run CONFIG --prove" in facts["convergence"]["why"]
    # A file of this name in the parent of a missing folder is not in the way.
    quiet = rbstab(*RUN, "-q", "-o", "results/again")
    assert (quiet.exit_code, quiet.stderr) == (0, "")
    assert printed("results/again/good.h5") in quiet.stdout
    assert "  This start:  proved: " in rbstab(*RUN, "--prove").stdout


def test_an_equal_run_is_repeated_by_force_only(folder):
    path = Path("results/good.h5")
    rbstab(*RUN)
    before = path.stat()
    again = success(*RUN, "--json")
    assert "already done" in again.stderr
    assert json.loads(again.stdout)[0]["computed"] is False
    assert (path.stat().st_ino, path.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    forced = rbstab(*RUN, "--json", "--force")
    assert json.loads(forced.stdout)[0]["computed"] is True
    assert path.stat().st_ino != before.st_ino
    assert list(Path("results").iterdir()) == [path]


def test_a_different_result_is_moved_aside_by_force_only(folder):
    rbstab(*RUN)
    old, before = api.open_result("results/good.h5"), Path("results/good.h5").read_bytes()
    refused = ended(4, *RUN, "--set", "body.mass=40")
    assert "holds a different result" in refused.stderr
    assert Path("results/good.h5").read_bytes() == before
    forced = rbstab(*RUN, "--set", "body.mass=40", "--force")
    aside = Path(f"results/good.{old.run_id[:8]}.h5")
    assert forced.exit_code == 0
    assert str(aside) in forced.stderr
    assert aside.read_bytes() == before
    assert api.open_result("results/good.h5").run_id != old.run_id


def test_a_run_that_fails_or_cannot_be_stored_leaves_its_neighbours(folder):
    leaves = GOOD.replace("[1, 2, -1]", "[0, 32, 0]").replace("[400, 400, 320]", "[4, 4, 3]")
    Path("a_leaves.yaml").write_text(leaves)
    done = ended(3, "run", "--no-prove", "a_leaves.yaml", "good.yaml")
    assert "a_leaves.yaml: range left: cos θ2 fell to 0.001 at t = 0.0" in done.stderr
    assert api.open_result("results/a_leaves.h5").status == "range left"
    assert api.open_result("results/good.h5").status == "completed"
    Path("other.yaml").write_text(GOOD)
    Path("in the way/good.h5").mkdir(parents=True)
    done = ended(4, "run", "--no-prove", "good.yaml", "other.yaml", "-o", "in the way")
    assert printed("in the way/good.h5") in done.stderr
    assert api.open_result("in the way/other.h5").status == "completed"


def test_a_run_without_its_proof_is_kept(folder, refuse):
    refuse("experiment.proof_cache.write_document", error=StoreError("the proof cannot be written"))
    done = ended(4, "run", "good.yaml")
    assert "good.yaml: the proof cannot be written" in done.stderr
    assert "  This start:  not decided: the Lyapunov function v fell" in done.stdout
    assert Path("results/good.h5").is_file()


WARNING = "the motion is not reproducible after t = 0.05 s (trusted_until)"


@pytest.fixture
def warned(folder, monkeypatch):
    """Two configs with a warning each, `a.yaml` and `b.yaml`; results of runs have another one."""
    names = ["a.yaml", "b.yaml"]
    for name in names:
        Path(name).write_text(GOOD.replace("[10.0, 9.0, 2.0]", "[10.0, 8.0, 0.4]"))
    monkeypatch.setattr("rbstab.experiment.simulate.motion_warnings", lambda _, **__: [WARNING])
    return names


def test_warnings_are_said_once_and_those_of_results_follow_their_answers(warned):
    done = rbstab("run", "--no-prove", *warned)
    given, *of_results = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert given.startswith("warning: a.yaml and 1 more: body.inertia: no real body")
    assert of_results == [f"warning: {Path('results', name)}.h5: {WARNING}" for name in ("a", "b")]
    assert WARNING not in done.stdout
    *_, whole_range, first, _, next_line = done.output.splitlines()
    assert whole_range.startswith("  Whole range: ")
    assert first == of_results[0]
    assert next_line.startswith("Next: ")
    again = rbstab("run", "--no-prove", *warned)
    assert again.stderr.count("already done") == again.stderr.count(WARNING) == len(warned)
    data = rbstab("run", "--no-prove", "--json", *warned)
    assert [WARNING in answer["warnings"] for answer in json.loads(data.stdout)] == [True, True]
    assert data.stderr.count(WARNING) == len(warned)
    assert WARNING not in rbstab("run", "--no-prove", "-q", *warned).output


SPINS = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 5]}
  controller.K_r: {scale: {values: [1, 2]}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_a_member_is_that_of_its_sweep(engine, folder):
    """Its engine is that of the sweep, or which the sweep would have."""
    Path("spins.yaml").write_text(SPINS)
    rbstab("run", "--no-prove", "spins.yaml", "--member", "1", "-q", "-o", "before")
    expected = load_plan("spins.yaml", ["integration.engine=heyoka"]).config_of(1)
    assert api.open_result("before/spins-member1.h5").run_id == run_id(expected)
    rbstab("sweep", "--no-prove", "spins.yaml", "--engine", engine, "-q")
    done = success("run", "--no-prove", "results/spins/plan.yaml", "--member", "3", "--json")
    assert json.loads(done.stdout)[0]["file"] == "results/spins-member3.h5"
    result, table = api.open_result("results/spins-member3.h5"), api.open_sweep("results/spins")
    # Member 3 has entry 1 of the five spins and entry 1 of the two factors.
    assert table["initial_angular_velocity_0"][3] == -2.0
    assert result["angular_velocity"][0].tolist() == [-2.0, 2.0, -1.0]
    assert result.attributes["title"] == "A short run, member 3"
    assert result.run_id == run_id(load_plan("results/spins/plan.yaml").config_of(3))
    assert result.attributes["engine"] == engine
    assert result["lyapunov"][0] == pytest.approx(table["lyapunov_start"][3], rel=1e-12)
    assert result["lyapunov"][-1] == pytest.approx(table["lyapunov_end"][3], rel=1e-9)
    assert result["position"][-1] == pytest.approx(table["final_position"][3], rel=1e-8)


def test_a_member_is_changed_by_its_base_and_kept_as_a_run(folder):
    Path("spins.yaml").write_text(SPINS)
    member = ("run", "--no-prove", "spins.yaml", "--member", "3", "--engine", "scipy")
    success(*member, "--set", "controller.K_r=[10, 20, 30]")
    stored = Path("results/spins-member3.h5")
    before = stored.read_bytes()
    assert "K_r: [20.0, 40.0, 60.0]" in api.open_result(stored).config
    again = rbstab(*member, "--set", "controller.K_r=[10, 20, 30]", "--member", "0")
    assert "already done" in again.stderr
    assert Path("results/spins-member0.h5").is_file()
    ended(4, *member)
    assert stored.read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize(("count", "command"), [(1, "show"), (2, "report"), (7, "report")])
def test_the_next_command_shows_or_reports_the_runs(count, command, folder):
    names = [f"a {number}.yaml" for number in range(count)]
    for name in names:
        Path(name).write_text(GOOD)
    done = rbstab("run", "--no-prove", "-o", "my results", *names)
    program, *words = words_of(done.stderr.splitlines()[-1].removeprefix("Next: "))
    assert (program, words[0]) == ("rbstab", command)
    shown = success(*words, *(["--format", "text"] if command == "report" else []))
    assert count == 1 or f"{count} runs" in shown.stdout
    files = [str(Path("my results", name).with_suffix(".h5")) for name in names]
    assert words[1:] == (files if count < 7 else ["my results"])
    assert count != 2 or f"{', '.join(files)}\n  Outcome: " in done.stdout
