"""Protects `rbstab run`: stored files, repeated and forced runs, failures, errors, interrupts."""

import json
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from cli.conftest import GOOD, Invoke, start
from support.printed_paths import printed

import rbstab as api
from rbstab.experiment import run_to_file


def test_a_run_leaves_a_file_and_a_table(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("run", "--no-prove", "good.yaml")
    assert done.exit_code == 0
    assert api.open_result("results/good.h5").status == "completed"
    header, line = done.stdout.splitlines()[:2]
    assert header.split()[:2] == ["file", "outcome"]
    assert line.split()[:2] == [printed("results/good.h5"), "still"]
    # The motion is not at rest after 0.1 s.
    assert line.split()[7] == "-"
    assert "At rest: v stays below v(0)/1000 from then on; -: not in this run." in done.stdout
    assert printed("Next: rbstab show results/good.h5") in done.stderr


def test_json_holds_the_facts(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("run", "--no-prove", "good.yaml", "--json", "-o", "elsewhere")
    (facts,) = json.loads(done.stdout)
    result = api.open_result("elsewhere/good.h5")
    assert facts["file"] == printed("elsewhere/good.h5")
    assert facts["run_id"] == result.run_id
    assert facts["lyapunov_start"] == result["lyapunov"][0]
    assert facts["end_time"] == 0.1
    assert facts["warnings"] == []
    assert facts["computed"] is True
    assert "repeated" not in facts


def test_a_finished_run_is_not_repeated(folder: Path, rbstab: Invoke) -> None:
    rbstab("run", "--no-prove", "good.yaml")
    before = Path("results/good.h5").read_bytes()
    again = rbstab("run", "--no-prove", "good.yaml", "--json")
    assert again.exit_code == 0
    assert "already done" in again.stderr
    assert json.loads(again.stdout)[0]["computed"] is False
    assert Path("results/good.h5").read_bytes() == before


def test_force_repeats_it(folder: Path, rbstab: Invoke) -> None:
    rbstab("run", "--no-prove", "good.yaml")
    before = Path("results/good.h5").stat().st_ino
    assert (
        json.loads(rbstab("run", "--no-prove", "good.yaml", "--json", "--force").stdout)[0][
            "computed"
        ]
        is True
    )
    assert Path("results/good.h5").stat().st_ino != before
    assert [path.name for path in Path("results").iterdir()] == ["good.h5"]


def test_a_different_result_is_never_overwritten(folder: Path, rbstab: Invoke) -> None:
    rbstab("run", "--no-prove", "good.yaml")
    before = Path("results/good.h5").read_bytes()
    refused = rbstab("run", "--no-prove", "good.yaml", "--set", "body.mass=40")
    assert refused.exit_code == 4
    assert "holds a different result" in refused.stderr
    assert Path("results/good.h5").read_bytes() == before


def test_force_moves_a_different_result_aside(folder: Path, rbstab: Invoke) -> None:
    rbstab("run", "--no-prove", "good.yaml")
    old = api.open_result("results/good.h5")
    before = Path("results/good.h5").read_bytes()
    forced = rbstab("run", "--no-prove", "good.yaml", "--set", "body.mass=40", "--force")
    aside = Path(f"results/good.{old.run_id[:8]}.h5")
    assert forced.exit_code == 0
    assert str(aside) in forced.stderr
    assert aside.read_bytes() == before
    assert api.open_result("results/good.h5").run_id != old.run_id


def test_a_damaged_file_is_refused_and_forced_aside(folder: Path, rbstab: Invoke) -> None:
    Path("results").mkdir()
    Path("results/good.h5").write_bytes(b"not a result")
    assert rbstab("run", "--no-prove", "good.yaml").exit_code == 4
    assert Path("results/good.h5").read_bytes() == b"not a result"
    assert rbstab("run", "--no-prove", "good.yaml", "--force").exit_code == 0
    assert Path("results/good.damaged.h5").read_bytes() == b"not a result"


def test_a_failed_run_is_stored_and_its_neighbours_go_on(folder: Path, rbstab: Invoke) -> None:
    leaves = GOOD.replace("[1, 2, -1]", "[0, 32, 0]").replace("[400, 400, 320]", "[4, 4, 3]")
    Path("a_leaves.yaml").write_text(leaves)
    done = rbstab("run", "--no-prove", "a_leaves.yaml", "good.yaml")
    assert done.exit_code == 3
    assert "a_leaves.yaml: range left: cos θ2 fell to 0.001 at t = 0.0" in done.stderr
    assert api.open_result("results/a_leaves.h5").status == "range left"
    assert api.open_result("results/good.h5").status == "completed"


def test_a_result_that_cannot_be_written_does_not_stop_the_others(
    folder: Path, rbstab: Invoke
) -> None:
    Path("other.yaml").write_text(GOOD)
    Path("results/good.h5").mkdir(parents=True)
    done = rbstab("run", "--no-prove", "good.yaml", "other.yaml")
    assert done.exit_code == 4
    assert printed("results/good.h5") in done.stderr
    assert api.open_result("results/other.h5").status == "completed"


def test_a_missing_engine_is_said(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "heyoka", None)
    for module in ("engine", "run"):
        monkeypatch.delitem(sys.modules, f"rbstab.integrate.heyoka.{module}", raising=False)
    done = rbstab("run", "--no-prove", "good.yaml", "--engine", "heyoka")
    assert done.exit_code == 2
    assert "the engine 'heyoka' cannot be used here" in done.stderr


def test_warnings_are_said_once_for_all_configs(folder: Path, rbstab: Invoke) -> None:
    for name in ("a.yaml", "b.yaml"):
        Path(name).write_text(GOOD.replace("[10.0, 9.0, 2.0]", "[10.0, 8.0, 0.4]"))
    done = rbstab("run", "--no-prove", "a.yaml", "b.yaml")
    warnings = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert len(warnings) == 1
    assert warnings[0].startswith("warning: a.yaml and 1 more: body.inertia: no real body")


WARNING = "the motion is not reproducible after t = 0.05 s (trusted_until)"


@pytest.fixture
def warned(folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Two configs with a warning each, `a.yaml` and `b.yaml`; results of runs have another one."""
    names = ["a.yaml", "b.yaml"]
    for name in names:
        Path(name).write_text(GOOD.replace("[10.0, 9.0, 2.0]", "[10.0, 8.0, 0.4]"))
    monkeypatch.setattr("rbstab.experiment.simulate.motion_warnings", lambda _: [WARNING])
    return names


def test_the_warnings_of_results_follow_their_answers(warned: list[str], rbstab: Invoke) -> None:
    """Each once for each result; what is said of the config is not repeated."""
    done = rbstab("run", "--no-prove", *warned)
    own = [line for line in done.stderr.splitlines() if line.startswith("warning: results")]
    assert own == [f"warning: {Path('results', name)}.h5: {WARNING}" for name in ("a", "b")]
    assert WARNING not in done.stdout
    *_, whole_range, first, _, next_line = done.output.splitlines()
    assert whole_range.startswith("  Whole range: ")
    assert first == own[0]
    assert next_line.startswith("Next: ")


def test_a_finished_result_warns_again(warned: list[str], rbstab: Invoke) -> None:
    rbstab("run", "--no-prove", *warned)
    again = rbstab("run", "--no-prove", *warned)
    assert again.stderr.count("already done") == len(warned)
    assert again.stderr.count(WARNING) == len(warned)


def test_many_results_have_their_warnings_below_the_table(
    warned: list[str], rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbstab_cli.output.answers.MAX_SENTENCES", 0)
    done = rbstab("run", "--no-prove", *warned)
    below = done.output.partition("rbstab show FILE says why.\n")[2]
    assert below.count(WARNING) == done.stderr.count(WARNING) == len(warned)


def test_json_leaves_the_warnings_on_stderr(warned: list[str], rbstab: Invoke) -> None:
    done = rbstab("run", "--no-prove", "--json", *warned)
    assert [WARNING in data["warnings"] for data in json.loads(done.stdout)] == [True, True]
    assert done.stderr.count(WARNING) == len(warned)


def test_a_quiet_run_leaves_out_the_warnings_of_results(warned: list[str], rbstab: Invoke) -> None:
    assert WARNING not in rbstab("run", "--no-prove", "-q", *warned).output


def test_an_interrupt_just_after_a_run_is_stored_counts_it(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = run_to_file.run_to_file

    def stored_and_interrupted(*arguments: Any, **options: Any) -> None:
        store(*arguments, **options)
        raise KeyboardInterrupt

    monkeypatch.setattr(run_to_file, "run_to_file", stored_and_interrupted)
    done = rbstab("run", "--no-prove", "good.yaml")
    assert done.exit_code == 130
    assert "Interrupted: 1 of 1 runs are stored." in done.stderr


def test_the_result_of_an_older_config_does_not_count_after_an_interrupt(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert rbstab("run", "--no-prove", "good.yaml").exit_code == 0
    Path("good.yaml").write_text(GOOD.replace("samples: 11", "samples: 21"))

    def interrupted(*arguments: Any, **options: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(run_to_file, "run_to_file", interrupted)
    done = rbstab("run", "--no-prove", "--force", "good.yaml")
    assert done.exit_code == 130
    assert "Interrupted: 0 of 1 runs are stored." in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT cannot be sent to one process")
def test_an_interrupt_keeps_what_is_done(folder: Path) -> None:
    endless = GOOD.replace("duration: 0.1, samples: 11", "duration: 1e6, samples: 2")
    Path("endless.yaml").write_text(endless)
    process = start("run", "--no-prove", "good.yaml", "endless.yaml")
    deadline = time.monotonic() + 60
    while not Path("results/good.h5").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Interrupted: 1 of 2 runs are stored." in stderr
    assert "Traceback" not in stderr
    assert "results/good.h5" in stdout
    assert [path.name for path in Path("results").iterdir()] == ["good.h5"]
