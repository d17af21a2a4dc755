"""Protects what long work says of itself: on a terminal, before its first part is done."""

import sys
from typing import Any

import pytest
from cli.conftest import GOOD, Invoke

from rbstab.experiment.start_sets.prove_starts import MAX_PARTS
from rbstab_cli.output.progress import compiling, fraction_bar, progress_bar


def use_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the captured stderr be a terminal of 100 columns."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("COLUMNS", "100")


def test_a_proof_of_all_starts_says_its_bound_and_how_to_stop(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    use_terminal(monkeypatch)
    with fraction_bar("one.yaml", wanted=True) as progress:
        assert progress is not None
    shown = capsys.readouterr().err
    assert f"at most {MAX_PARTS} parts" in shown
    assert "Ctrl-C stops" in shown
    assert "one.yaml" in shown


def test_nothing_is_shown_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    with fraction_bar("one.yaml", wanted=True) as progress:
        assert progress is None
    with progress_bar("one.yaml", 3.0, wanted=True, before="compiling") as callback:
        assert callback is None
    assert capsys.readouterr().err == ""


def test_a_run_says_what_is_done_before_its_first_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    use_terminal(monkeypatch)
    with progress_bar("one.yaml", 3.0, wanted=True, before="compiling much") as progress:
        assert progress is not None
    assert "one.yaml: compiling much" in capsys.readouterr().err


def test_only_long_compilations_are_announced() -> None:
    assert "equations of 13 elements" in compiling("heyoka", 13)
    assert compiling("heyoka", 3) == compiling("scipy", 13) == ""


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("option", "shown"),
    [("controller=±1%", "all bodies"), ("initial.angular_velocity[0]=±0.01", "all starts")],
)
def test_stability_shows_the_proof_that_is_at_work(
    rbstab: Invoke, monkeypatch: pytest.MonkeyPatch, option: str, shown: str
) -> None:
    """The stages of the command are named in their order, with the file."""
    names: list[str] = []
    module = "rbstab_cli.output.progress"
    bar, working = sys.modules[module].fraction_bar, sys.modules[module].working

    def noted_bar(name: str, *, wanted: bool) -> Any:
        names.append(f"{name}: all starts" if wanted else "")
        return bar(name, wanted=wanted)

    def noted_working(name: str, *, wanted: bool) -> Any:
        names.append(name if wanted else "")
        return working(name, wanted=wanted)

    monkeypatch.setattr(f"{module}.fraction_bar", noted_bar)
    monkeypatch.setattr(f"{module}.working", noted_working)
    assert "duration: 0.1" in GOOD
    assert rbstab("stability", "good.yaml", "--no-run", "--within", option).exit_code == 0
    stages = (shown, "rest states", "exact motion")
    assert names == [f"good.yaml: {stage}" for stage in stages]
    names.clear()
    done = rbstab("stability", "good.yaml", "--no-run", "--within", option, "--quiet")
    assert done.exit_code == 0
    assert done.stderr == ""
    assert names == [""] * len(stages)


def test_a_quiet_proof_shows_nothing_on_a_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    use_terminal(monkeypatch)
    with fraction_bar("one.yaml", wanted=False) as progress:
        assert progress is None
    assert capsys.readouterr().err == ""
