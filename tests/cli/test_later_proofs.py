"""Every command says the same of a stored result, also if its proof was made after it."""

import json
import shutil
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke
from support.printed_paths import printed, words_of

from rbstab.sweep.folder.member_answers import member_answers

FALSE = GOOD.replace("K_r: [400, 400, 320]", "K_r: [40, 40, 32]").replace("free", "permanent")
"""With a tenth of the stiffness the body has several rest states."""


def words(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture
def proved_later(folder: Path, rbstab: Invoke) -> Path:
    """A run without a proof, beside the proof of its rest states."""
    assert rbstab("run", "good.yaml", "--no-prove", "-q").exit_code == 0
    assert rbstab("stability", "good.yaml", "--results", "results").exit_code == 0
    return Path("results/good.h5")


def test_show_says_one_thing(proved_later: Path, rbstab: Invoke) -> None:
    shown = words(rbstab("show", str(proved_later)).stdout)
    assert "This start: proved" in shown
    assert "Whole range: proved" in shown
    assert "global stability proved rest states in the range 1 = 1" in shown
    assert "certified region proved start above rest state 1, J" in shown
    assert "proved to be the only one in the range" in shown
    assert "nothing is proved" not in shown
    assert "no lower one is known" not in shown
    data = json.loads(rbstab("show", str(proved_later), "--json").stdout)
    assert data["answers"]["this_start"]["word"] == "proved"
    assert data["convergence"]["proved"] is True
    by_check = {line["check"]: line["word"] for line in data["certificate"]}
    assert by_check["certified region"] == by_check["global stability"] == "proved"
    assert data["checks"] == "seen"
    assert data["verdict"] == "consistent"


def test_list_and_compare_say_it_too(proved_later: Path, rbstab: Invoke) -> None:
    (entry,) = json.loads(rbstab("list", "--json").stdout)
    assert (entry["this_start"], entry["whole_range"]) == ("proved", "returns: proved")
    assert (entry["converges"], entry["checks"]) == ("proved", "seen")
    rbstab("run", "good.yaml", "-o", "other", "-q")
    rows = json.loads(rbstab("compare", str(proved_later), "other/good.h5", "--json").stdout)
    assert all(row["first"] == row["second"] for row in rows["outcomes"])


def test_a_case_with_several_rest_states_prints_the_same_twice(
    folder: Path, rbstab: Invoke
) -> None:
    Path("false.yaml").write_text(FALSE)
    first = rbstab("run", "false.yaml")
    again = rbstab("run", "false.yaml")
    assert "Whole range: proved: returns: almost every start" in words(first.stdout)
    assert "Lyapunov argument fails" not in first.stderr + again.stderr
    ends = [done.stdout[done.stdout.index("This start") :] for done in (first, again)]
    assert ends[0] == ends[1]


PLAN = "base: good.yaml\nvary:\n  initial.angular_velocity[1]: {values: [1, 2, 60]}\n"


def test_a_sweep_counts_later_proofs_everywhere(folder: Path, rbstab: Invoke) -> None:
    Path("plan.yaml").write_text(PLAN)
    first = rbstab("sweep", "plan.yaml", "--no-prove")
    # Without any proof, there is nothing to say but how many settled.
    assert "converge to a rest" not in first.stdout
    again = rbstab("sweep", "plan.yaml")
    assert "proved for 2 of the members" in again.stdout
    assert "unknown" not in again.stdout
    assert "converge to a rest state" not in again.stdout
    without = words(rbstab("sweep", "plan.yaml", "--no-prove").stdout)
    assert "converge to a rest state 2 proved, 1 not decided" in without
    (entry,) = json.loads(rbstab("list", "--json").stdout)
    assert entry["converges"] == entry["this_start"] == "2 of 3 proved"
    shown = words(rbstab("show", "results/plan").stdout)
    assert shown.index("proved: 2 of 3 members: they") < shown.index("quantity value")
    assert "settled: " in shown
    data = json.loads(rbstab("show", "results/plan/members.h5", "--json").stdout)["answers"]
    assert (data["members"], data["proved"], data["without_proof"]) == (3, 2, {})
    assert data["proved"] + data["false"] + data["seen"] + data["not_decided"] == 3
    row = rbstab("compare", "results/plan", "results/plan").stdout
    assert "members: come to rest, proved 2 of 3 2 of 3" in words(row)
    assert "unknown" not in row


def test_a_sweep_names_the_members_without_a_proof(folder: Path, rbstab: Invoke) -> None:
    Path("plan.yaml").write_text(
        PLAN.replace("[1, 2, 60]", "[1]") + "  body.mass: {values: [40]}\n"
    )
    rbstab("sweep", "plan.yaml", "--no-prove", "-q")
    shown = words(rbstab("show", "results/plan").stdout)
    assert "no proof: 1 of 1 members: the proof of their own body was not made" in shown


def test_the_command_that_proves_them_works_wherever_the_sweep_is_now(
    folder: Path, rbstab: Invoke
) -> None:
    Path("varied.yaml").write_text(PLAN)
    rbstab("sweep", "varied.yaml", "--no-prove", "-q")
    Path("varied.yaml").rename("plan of yesterday.yaml")

    def advised(stored: str) -> list[str]:
        """Return the command that `show` advises, as arguments; it is not yet proved."""
        (line,) = [
            line
            for line in rbstab("show", stored).stdout.splitlines()
            if line.strip().startswith("no proof:")
        ]
        program, *arguments = words_of(line.partition("make it: ")[2].removesuffix("."))
        assert program == "rbstab"
        return arguments

    assert advised("results/varied") == ["sweep", printed("results/varied/plan.yaml"), "--prove"]
    assert advised(str(Path("results/varied").absolute()))[2] == "-o"
    # Without the copy of the plan, the plan of the user is needed.
    shutil.copytree("results/varied", "alone", ignore=shutil.ignore_patterns("plan.yaml"))
    (reason,) = member_answers(Path("alone/members.h5")).without_proof
    assert reason.endswith("rbstab sweep PLAN.yaml --prove")
    Path("my results").mkdir()
    kept = Path("results/varied").rename("my results/kept one")
    done = rbstab(*advised(str(kept)))
    assert "members are already done" in done.stderr
    assert "proved for 2 of the members" in done.stdout
    assert "no proof:" not in rbstab("show", str(kept)).stdout
    assert not Path("results/kept one").exists()
