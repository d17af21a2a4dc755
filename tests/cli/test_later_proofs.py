"""Every command says the same of a stored result, also if its proof was made after it."""

import json
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke

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
