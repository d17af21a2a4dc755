"""`rbstab sweep` says unasked how many members are proved to converge, after it has stored them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cli.conftest import GOOD, Invoke
from support.printed_paths import printed, words_of

import rbstab as rbstab_package
from rbstab.experiment.answers.outcome import KINDS
from rbstab.experiment.answers.wanted import wanted
from rbstab.sweep.folder.member_answers import MemberAnswers
from rbstab.sweep.folder.outcomes import SweepOutcomes
from rbstab.sweep.proofs import prove_bodies
from rbstab_cli.output.sweeps.sweep_report import answers_data, counts_of, print_member_answers

PLAN = """\
base: good.yaml
vary:
  initial.angular_velocity[1]: {values: [1, 2, 60]}
"""


class FakeClock:
    """A clock that only proofs advance, so that no test depends on the machine."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now

    def taking(self, seconds: float, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function; each call takes this time."""

        def slow(*arguments: Any) -> Any:
            self.now += seconds
            return function(*arguments)

        return slow


@pytest.mark.usefixtures("plan")
def test_members_that_start_in_a_region(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("sweep", "plan.yaml")
    assert done.exit_code == 0, done.output
    *_, proved, not_proved = done.stdout.splitlines()
    assert proved == "Convergence: proved for 2 of the members: they start in a certified region."
    assert not_proved.startswith("Convergence: not proved for 1 of the members: they start outside")
    # So it is in the file, and in the report, which makes no proofs.
    table = rbstab_package.open_sweep("results/plan")
    assert table.words("convergence").tolist() == ["proved", "proved", "not proved"]
    shown = rbstab("report", "results/plan", "--format", "text")
    assert "2 of 3 members are proved to converge to a rest state" in " ".join(shown.stdout.split())


@pytest.mark.usefixtures("plan")
def test_nothing_is_proved_on_request(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("sweep", "plan.yaml", "--no-prove")
    assert "Convergence" not in done.stdout
    assert not (folder / "results/proofs").exists()


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize("place", ["results", "other place"])
def test_show_names_the_command_that_proves_a_member(
    place: str, folder: Path, rbstab: Invoke
) -> None:
    """The motion of the last member enters the region, outside of which it starts."""
    Path("good.yaml").write_text(GOOD.replace("duration: 0.1", "duration: 6"))
    assert rbstab("sweep", "plan.yaml", "--engine", "scipy", "-o", place).exit_code == 0
    sweep = str(Path(place, "plan"))
    done = rbstab("show", sweep)
    assert "seen:        1 of 3 members" in done.stdout
    head, _, command = done.stderr.splitlines()[-1].partition(": rbstab ")
    assert head == "Or try to prove a member that is only seen"
    words = words_of(command)
    assert words[-3:] == ["--member", "2", "--prove"]
    assert "This start:  proved" in rbstab(*words).stdout
    assert Path(place, "plan-member2.h5").exists()
    shown = json.loads(rbstab("show", sweep, "--json").stdout)["answers"]
    assert (shown["seen"], shown["provable"]) == (1, 2)


@pytest.mark.usefixtures("plan")
def test_no_command_is_named_where_none_proves_more(folder: Path, rbstab: Invoke) -> None:
    """No motion of a sliding connector can be enclosed; and the others are proved, or not seen."""
    assert rbstab("sweep", "plan.yaml", "--engine", "scipy").exit_code == 0
    assert "Or try to prove" not in rbstab("show", "results/plan").stderr
    law = "variant: sliding\n  surface: {slope: 20}\n  law: exact\n  K_s: [20000, 20000, 20000]"
    text = GOOD.replace("duration: 0.1", "duration: 6").replace("variant: free", law)
    Path("good.yaml").write_text(text)
    Path("slides.yaml").write_text(PLAN.replace(", 60", ""))
    done = rbstab("sweep", "slides.yaml", "--engine", "scipy", "--no-prove")
    assert done.exit_code == 0, done.output
    done = rbstab("show", "results/slides")
    assert "seen:        2 of 2 members" in done.stdout
    assert "Or try to prove" not in done.stderr


def test_members_with_bodies_of_their_own(folder: Path, rbstab: Invoke) -> None:
    Path("bodies.yaml").write_text("base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n")
    done = rbstab("sweep", "bodies.yaml")
    assert done.exit_code == 0, done.output
    *_, proved, effort = done.stdout.splitlines()
    assert proved == "Convergence: proved for 2 of the members: they start in a certified region."
    assert effort.startswith("Convergence: the proofs of 2 distinct bodies took ")
    assert effort.endswith(" s of at most 10 s.")
    assert "for at most 10 s" in done.stderr
    assert len(list((folder / "results/proofs").iterdir())) == 2
    shown = rbstab("report", "results/bodies", "--format", "text")
    assert "2 of 2 members are proved to converge to a rest state" in " ".join(shown.stdout.split())


def test_bodies_that_the_budget_does_not_reach(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are "not proved" and named, in the summary, in the JSON and in the report."""
    text = PLAN.replace("[1, 2, 60]", "[1]") + "  body.mass: {linspace: [40, 44, 5]}\n"
    Path("bodies.yaml").write_text(text)
    words = ("sweep", "bodies.yaml", "--threads", "1")
    monkeypatch.setattr(prove_bodies, "BUDGET", 0.0)
    done = rbstab(*words)
    assert done.exit_code == 0, done.output
    (line,) = [one for one in done.stdout.splitlines() if one.startswith("Convergence")]
    assert line.startswith(
        "Convergence: not proved for 5 of the members: the budget of 0 s reached 0 of 5 distinct "
        "bodies, and not those of members 0 to 4. Run the same command again to go on"
    )
    shown = " ".join(rbstab("report", "results/bodies", "--format", "text").stdout.split())
    assert "Not proved: no proof was made for any of the 5 members" in shown
    assert "reached 0 of 5" not in shown
    clock = FakeClock()
    monkeypatch.setattr(prove_bodies, "BUDGET", 20.0)
    monkeypatch.setattr(prove_bodies, "monotonic", clock)
    monkeypatch.setattr(prove_bodies, "_prove", clock.taking(10.0, prove_bodies._prove))
    monkeypatch.setattr("rbstab.processes.processors.processor_count", lambda: 1)
    proofs = json.loads(rbstab(*words, "--json").stdout)["proofs"]
    assert proofs["bodies"] == 5
    assert proofs["reached"] == 2
    assert proofs["budget"] == 20.0
    assert proofs["members"] == {"proved": 2, "not reached": 3}
    assert proofs["members_not_reached"] == [[1, 2], [4, 4]]
    shown = " ".join(rbstab("report", "results/bodies", "--format", "text").stdout.split())
    assert "2 of the 2 members that were tried are proved to converge to a rest state" in shown
    assert "was not made, or ended early: members 1 to 2, 4. rbstab sweep " in shown
    command = shown.partition("members 1 to 2, 4. ")[2].partition(" makes it")[0]
    assert command == printed("rbstab sweep results/bodies/plan.yaml --prove")
    # The next call goes on.
    again = json.loads(rbstab(*words, "--json").stdout)
    ((first, last),) = again["proofs"]["members_not_reached"]
    assert first == last in {1, 2, 4}
    assert again["convergence"] == {"unknown": 1, "proved": 4}
    without_limit = rbstab(*words, "--prove")
    assert "proved for 5 of the members" in without_limit.stdout
    assert "without a limit of time" in without_limit.stderr
    assert "not proved" not in without_limit.stdout


def _elements(element: str) -> None:
    """Write the plan `lines.yaml` over the first config with one more element, x."""
    text = Path("good.yaml").read_text().replace("title:", "schema_version: 2\ntitle:")
    Path("more.yaml").write_text(f"{text}elements: {{x: {{{element}}}}}\n")
    vary = "vary:\n  initial.angular_velocity[1]: {values: [1, 60]}\n"
    Path("lines.yaml").write_text(f"base: more.yaml\n{vary}")


def test_members_that_no_theorem_decides(folder: Path, rbstab: Invoke) -> None:
    _elements(
        "kind: input, quantity: force, point: [0, 0, 0], direction: [1, 0, 0], amplitude: 1, "
        "signal: {kind: sine, frequency: 1}"
    )
    done = rbstab("sweep", "lines.yaml")
    assert done.exit_code == 0, done.output
    assert "Convergence: not proved; an input supplies power" in done.stdout


def test_members_beside_a_soft_guard(folder: Path, rbstab: Invoke) -> None:
    # The second turns so fast that its energy is above the level of the region.
    _elements("kind: guard, method: stiff, soft_angle: 1.2, stiffness: 100")
    done = rbstab("sweep", "lines.yaml")
    assert done.exit_code == 0, done.output
    *_, proved, not_proved = done.stdout.splitlines()
    assert proved == "Convergence: proved for 1 of the members: they start in a certified region."
    assert not_proved.startswith("Convergence: not proved for 1 of the members: they start outside")


def test_a_body_that_refutes_is_named_by_all_commands(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More bodies than the budget is for: many are proved at once, or a body refutes the claim."""
    monkeypatch.setattr("rbstab.sweep.sweep.FEW", 3)
    monkeypatch.setattr(prove_bodies, "BUDGET", 0.0)
    text = Path("good.yaml").read_text().replace("variant: free", "variant: permanent")
    Path("heavy.yaml").write_text(f"{text}gravity: [0, 0, -9.81]\n")
    gains = "{scale: {linspace: [0.1, 0.3, 4]}}"
    Path("weak.yaml").write_text(f"base: heavy.yaml\nvary: {{controller.K_r: {gains}}}\n")
    done = rbstab("sweep", "weak.yaml", "--threads", "1")
    assert done.exit_code == 0, done.output
    first, second, *_ = [
        line.removeprefix("Convergence: ").removesuffix(".")
        for line in done.stdout.splitlines()
        if line.startswith("Convergence: ")
    ]
    assert first.startswith("one rest state in the range of the Euler angles, a minimum: proved")
    assert second.startswith("for every body between the least and the greatest value of each")
    assert "one rest state, a minimum: false, proved. The body with controller.K_r = [" in second
    shown = " ".join(rbstab("show", "results/weak").stdout.split())
    report = " ".join(rbstab("report", "results/weak", "--format", "text").stdout.split())
    for sentence in (first, second):
        for output in (shown, report):
            assert f"{sentence[0].upper()}{sentence[1:]}." in output
    assert "Has each body between the bounds of the plan one rest state? false." in report
    stored = json.loads(rbstab("show", "results/weak", "--json").stdout)["answers"]["one_state"]
    again = json.loads(rbstab("sweep", "weak.yaml", "--json").stdout)
    assert stored == again["answers"]["one_state"] == again["proofs"]["one_rest_state"]
    assert next(iter(again)) == "outcomes"
    assert sum(again["outcomes"].values()) == again["members"]
    assert shown.index("Outcome: ") < shown.index("Desired: ") < shown.index("rest states: ")
    assert stored["bodies"] == stored["proved"] + stored["false"] + stored["not_decided"] == 4
    (counterexample,) = stored["counterexamples"]
    assert counterexample["variant"] == "permanent"
    assert len(counterexample["rest_states"]) > 1


def test_counts_of_many_members_have_separators(capsys: pytest.CaptureFixture[str]) -> None:
    counts = dict(zip(KINDS, (12_000, 9999, 8001, 0, 0), strict=True))
    outcomes = SweepOutcomes(counts, 1234, 8, 2, "5 s", wanted(None), "")
    found = MemberAnswers(
        30_000, 9999, 0, 12_000, 8001, 21_999, 30_000, {"why": 20_001}, outcomes, {}
    )
    print_member_answers(found)
    outcome, desired, *lines = capsys.readouterr().out.splitlines()
    assert outcome == (
        "  Outcome:     returns: 12,000 of 30,000 members, 1234 of them proved; "
        "rests elsewhere: 9999; still moving at 5 s: 8001, 8 of them proved to come to rest later."
    )
    assert desired == "  Desired:     upright (default), within 10°."
    assert lines[0].startswith("  proved:      9999 of 30,000 members: ")
    assert lines[1].startswith("  seen:        12,000 of 30,000 members: ")
    assert lines[3].startswith("  settled:     21,999 of the 30,000 that completed")
    assert lines[4] == "  no proof:    20,001 of 30,000 members: why."
    assert counts_of(found) == "9999 proved, 12,000 seen, 8001 not decided"
    assert answers_data(found)["members"] == 30_000
    assert "outcomes" not in answers_data(found)
