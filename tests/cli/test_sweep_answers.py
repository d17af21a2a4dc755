"""`rbstab sweep` says unasked how many members are proved to converge, after it has stored them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cli.conftest import GOOD, json_of, rbstab, success
from support.gusts import mast
from support.printed_paths import printed, words_of

import rbstab as rbstab_package
from rbstab.experiment.answers.outcome import KINDS, OutcomeKind
from rbstab.experiment.answers.wanted import wanted
from rbstab.sweep.folder.member_answers import MemberAnswers
from rbstab.sweep.folder.outcomes import SweepOutcomes
from rbstab.sweep.proofs import prove_bodies
from rbstab_cli.work.sweeps.tables import counts_of, print_member_answers

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


def test_members_that_start_in_a_region(plan, folder):
    done = success("sweep", "plan.yaml")
    *_, proved, not_proved = done.stdout.splitlines()
    assert proved == "Convergence: proved for 2 of the members: they start in a certified region."
    assert not_proved.startswith("Convergence: not proved for 1 of the members: they start outside")
    assert "Or try to prove" not in rbstab("show", "results/plan").stderr
    # So it is in the file, and in the report, which makes no proofs.
    table = rbstab_package.open_sweep("results/plan")
    assert table.words("convergence").tolist() == ["proved", "proved", "not proved"]
    shown = rbstab("report", "results/plan", "--format", "text")
    assert "converges to rest state 1: proved 2 not proved at the start" in words(shown.stdout)


def test_show_names_the_command_that_proves_a_member(plan, folder):
    """The motion of the last member enters the region, outside of which it starts."""
    Path("good.yaml").write_text(GOOD.replace("duration: 0.1", "duration: 6"))
    place = "other place"
    success("sweep", "plan.yaml", "--engine", "scipy", "-o", place)
    sweep = str(Path(place, "plan"))
    done = rbstab("show", sweep)
    assert "seen:        1 of 3 members" in done.stdout
    head, _, command = done.stderr.splitlines()[-1].partition(": rbstab ")
    assert head == "Or try to prove a member that is only seen"
    words = words_of(command)
    assert words[-3:] == ["--member", "2", "--prove"]
    assert "This start:  proved" in rbstab(*words).stdout
    assert Path(place, "plan-member2.h5").exists()
    shown = json_of("show", sweep)["answers"]
    assert (shown["seen"], shown["provable"]) == (1, 2)


def test_counts_of_many_members_have_separators(capsys):
    counts = dict.fromkeys(KINDS, 0)
    counts |= {OutcomeKind.RETURNS: 12_000, OutcomeKind.RESTS_ELSEWHERE: 9999}
    counts[OutcomeKind.MOVING] = 8001
    outcomes = SweepOutcomes(counts, 1234, 8, 2, "5 s", wanted(None), "")
    answers = MemberAnswers(
        30_000, 9999, 0, 12_000, 8001, 21_999, 30_000, {"why": 20_001}, outcomes, {}
    )
    print_member_answers(answers)
    outcome, desired, *lines = capsys.readouterr().out.splitlines()
    assert outcome == (
        "  Outcome:     returns: 12,000 of 30,000 members, 1234 of them proved; "
        "rests elsewhere: 9999; still moving at 5 s: 8001, 8 of them proved to come to rest later."
    )
    assert desired == "  Desired:     upright (default), within 10°."
    assert lines[4] == "  no proof:    20,001 of 30,000 members: why."
    assert counts_of(answers) == "9999 proved, 12,000 seen, 8001 not decided"


def words(text):
    return " ".join(text.split())


@pytest.mark.slow
def test_bodies_that_the_budget_does_not_reach_are_named(folder, monkeypatch):
    """In the summary, in the JSON and in the report, with the command that goes on."""
    text = PLAN.replace("[1, 2, 60]", "[1]") + "  body.mass: {linspace: [40, 44, 5]}\n"
    Path("bodies.yaml").write_text(text)
    sweep, report = ("sweep", "bodies.yaml", "--threads", "1"), ("report", "results/bodies")
    monkeypatch.setattr(prove_bodies, "BUDGET", 0.0)
    done = success(*sweep)
    (line,) = [row for row in done.stdout.splitlines() if row.startswith("Convergence")]
    assert line.startswith(
        "Convergence: not proved for 5 of the members: the budget of 0 s reached 0 of 5 distinct "
        "bodies, and not those of members 0 to 4. Run the same command again to go on"
    )
    shown = words(rbstab(*report, "--format", "text").stdout)
    assert "No proof was made of the bodies of any member: rbstab sweep" in shown
    clock = FakeClock()
    monkeypatch.setattr(prove_bodies, "BUDGET", 20.0)
    monkeypatch.setattr(prove_bodies, "monotonic", clock)
    monkeypatch.setattr(prove_bodies, "_prove", clock.taking(10.0, prove_bodies._prove))
    monkeypatch.setattr("rbstab.processes.processors.processor_count", lambda: 1)
    proofs = json_of(*sweep)["proofs"]
    assert (proofs["bodies"], proofs["reached"], proofs["budget"]) == (5, 2, 20.0)
    assert proofs["members"] == {"proved": 2, "not reached": 3}
    assert proofs["members_not_reached"] == [[1, 2], [4, 4]]
    shown = words(rbstab(*report, "--format", "text").stdout)
    assert "converges to rest state 1: proved 2 no proof of its own body" in shown
    command = shown.partition("members 1 to 2, 4: ")[2].partition(" makes it")[0]
    assert command == printed("rbstab sweep results/bodies/plan.yaml --prove")
    again = json_of(*sweep)
    assert again["convergence"] == {"unknown": 1, "proved": 4}
    without_limit = rbstab(*sweep, "--prove")
    assert "proved for 5 of the members" in without_limit.stdout
    assert "without a limit of time" in without_limit.stderr


@pytest.mark.slow
def test_a_body_that_refutes_is_named_by_all_commands(folder, monkeypatch):
    """More bodies than the budget is for: many are proved at once, or a body refutes the claim."""
    monkeypatch.setattr("rbstab.sweep.sweep.FEW", 3)
    monkeypatch.setattr(prove_bodies, "BUDGET", 0.0)
    Path("heavy.yaml").write_text(
        f"{GOOD.replace('variant: free', 'variant: permanent')}gravity: [0, 0, -9.81]\n"
    )
    gains = "{scale: {linspace: [0.1, 0.3, 4]}}"
    Path("weak.yaml").write_text(f"base: heavy.yaml\nvary: {{controller.K_r: {gains}}}\n")
    done = success("sweep", "weak.yaml", "--threads", "1")
    lines = [line for line in done.stdout.splitlines() if line.startswith("Convergence: ")]
    first, second = (line.removeprefix("Convergence: ").removesuffix(".") for line in lines[:2])
    assert first.startswith("one rest state in the range of the Euler angles, a minimum: proved")
    assert second.startswith("for every body between the least and the greatest value of each")
    assert "one rest state, a minimum: false, proved. The body with controller.K_r = [" in second
    shown = words(rbstab("show", "results/weak").stdout)
    report = words(rbstab("report", "results/weak", "--format", "text").stdout)
    for sentence in (first, second):
        assert f"{sentence[0].upper()}{sentence[1:]}." in shown
        assert f"{sentence[0].upper()}{sentence[1:]}." in report
    assert shown.index("Outcome: ") < shown.index("Desired: ") < shown.index("rest states: ")
    stored = json_of("show", "results/weak")["answers"]["one_state"]
    again = json_of("sweep", "weak.yaml")
    assert stored == again["answers"]["one_state"] == again["proofs"]["one_rest_state"]
    assert sum(again["outcomes"].values()) == again["members"]
    assert stored["bodies"] == stored["proved"] + stored["false"] + stored["not_decided"] == 4
    (counterexample,) = stored["counterexamples"]
    assert counterexample["variant"] == "permanent"
    assert len(counterexample["rest_states"]) > 1


@pytest.mark.slow
def test_motions_are_proved_member_by_member_on_request(plan, statuses):
    text = PLAN.replace("velocity[1]", "velocity[0]").replace("[1, 2, 60]", "[1, 14, 16, 500]")
    Path("plan.yaml").write_text(f"{text}prove: {{motion: {{steps: 20}}}}\n")
    done = success("sweep", "plan.yaml", "--shard-size", "2", "--threads", "1")
    said = "\n".join(statuses)
    assert "2 of 4 members proved, " in said
    assert "3 of 4 members proved, " in said
    (row,) = [line for line in done.stdout.splitlines() if "converge to a rest state" in line]
    assert "3 proved, 1 not decided" in row
    again = json_of("sweep", "plan.yaml")
    assert again["convergence"] == {"proved": 3, "not decided": 1}
    assert len(list(Path("results/proofs").iterdir())) == 1


@pytest.mark.slow
def test_a_sweep_counts_later_proofs_everywhere(plan):
    first = rbstab("sweep", "plan.yaml", "--no-prove")
    # Without any proof, there is nothing to say but how many settled.
    assert "onverge" not in first.stdout
    assert not Path("results/proofs").exists()
    assert "proved for 2 of the members" in rbstab("sweep", "plan.yaml").stdout
    without = words(rbstab("sweep", "plan.yaml", "--no-prove").stdout)
    assert "converge to a rest state 2 proved, 1 not decided" in without
    (entry,) = json_of("list")
    assert entry["converges"] == entry["this_start"] == "2 of 3 proved"
    shown = words(rbstab("show", "results/plan").stdout)
    assert shown.index("proved: 2 of 3 members: they") < shown.index("quantity value")
    data = json_of("show", "results/plan/members.h5")["answers"]
    assert (data["members"], data["proved"], data["without_proof"]) == (3, 2, {})
    assert data["proved"] + data["false"] + data["seen"] + data["not_decided"] == 3
    row = words(rbstab("compare", "results/plan", "results/plan").stdout)
    assert "members: come to rest, proved 2 of 3 2 of 3" in row
    assert "unknown" not in row


@pytest.mark.slow
def test_the_command_that_proves_them_works_wherever_the_sweep_is_now(folder):
    Path("varied.yaml").write_text(PLAN)
    rbstab("sweep", "varied.yaml", "--no-prove", "-q")
    Path("varied.yaml").rename("plan of yesterday.yaml")

    def advised(stored: str) -> list[str]:
        """Return the command that `show` advises, as arguments; it is not yet proved."""
        lines = rbstab("show", stored).stdout.splitlines()
        (line,) = [line for line in lines if line.strip().startswith("no proof:")]
        program, *arguments = words_of(line.partition("make it: ")[2].removesuffix("."))
        assert program == "rbstab"
        return arguments

    assert advised("results/varied") == ["sweep", printed("results/varied/plan.yaml"), "--prove"]
    assert advised(str(Path("results/varied").absolute()))[2] == "-o"
    Path("my results").mkdir()
    kept = Path("results/varied").rename("my results/kept one")
    done = rbstab(*advised(str(kept)))
    assert "members are already done" in done.stderr
    assert "proved for 2 of the members" in done.stdout
    assert "no proof:" not in rbstab("show", str(kept)).stdout
    assert not Path("results/kept one").exists()


@pytest.mark.heavy
def test_a_stated_bound_is_proved_and_said(folder):
    """By the command, in its JSON, and by show; and not with --no-prove."""
    plan = {"base": mast(), "vary": {"elements.gust0.amplitude": {"values": [15, 60]}}}
    Path("gusts.yaml").write_text(json.dumps(plan))
    bare = success("sweep", "gusts.yaml", "--no-prove", "-o", "bare").stdout
    assert "for ever: not proved." in bare
    lines = success("sweep", "gusts.yaml").stdout.splitlines()
    said = dict(line.strip().split(":", 1) for line in lines if ": " in line)
    assert said["Worst tilt"].endswith("member 1, couple up to 60 N m.")
    assert said["Leaves"].strip() == "tilt above 0.5 rad: 1 of 2 members (50 %) by 3 s."
    assert said["Bound"].endswith("keeps the tilt below 0.5 rad for ever: proved.")
    assert said["For ever"].strip().startswith("1 of 2 members stay below 0.5 rad: proved; not")
    shown = rbstab("show", "results/gusts").stdout
    assert all(f"{word}:" in shown and text in shown for word, text in list(said.items())[2:6])
    for command in (("sweep", "gusts.yaml"), ("show", "results/gusts")):
        found = json_of(*command)["answers"]["disturbed"]
        assert (found["proved"], found["left"], found["worst_member"]) == (1, 1, 1)
        assert found["interval"] is None
    table = rbstab_package.open_sweep("results/gusts")
    assert table.words("stated_bound").tolist() == ["proved", "larger load"]
    assert rbstab_package.open_sweep("bare/gusts/members.h5").words("stated_bound")[0] == "no proof"
    assert json_of("show", "results/gusts")["answers"]["disturbed"]["statements"].keys() == {
        *("Worst tilt", "Leaves", "Bound", "For ever")
    }
