"""Protects `rbstab stability --bound`, and the section `bound` of a config."""

import pytest
from cli.conftest import GOOD, ended, json_of

from rbstab.store.document import read_document, write_document

HELD = GOOD.replace("variant: free", "variant: permanent")


@pytest.mark.slow
def test_what_is_proved_of_disturbances_is_printed_first_and_is_in_the_json(folder):
    (folder / "held.yaml").write_text(HELD)
    words = ("stability", "held.yaml", "--no-run", "--bound", "couple=60", "--within-tilt", "0.5")
    printed = ended(0, *words).stdout.splitlines()
    assert printed[2].startswith("  Any disturbance couple up to 60 N m keeps the tilt of this bod")
    (facts,) = json_of(*words)
    bound = facts["bound"]
    assert bound["statements"][0] == printed[2].strip()
    assert (bound["proved"], bound["couple"], bound["force"]) == (True, 60.0, None)
    assert (bound["tilt"], bound["why"], bound["largest"]) == (0.5, "", None)
    assert bound["level"] > 0


STATED = HELD + "bound: {couple: 60, tilt: 0.5}\n"


@pytest.mark.slow
def test_a_config_states_a_bound_as_the_options_do(folder):
    (folder / "held.yaml").write_text(HELD)
    (folder / "stated.yaml").write_text(STATED)
    (asked,) = json_of(
        *("stability", "held.yaml", "--no-run", "--bound", "couple=60", "--within-tilt", "0.5")
    )
    (stated,) = json_of("stability", "stated.yaml", "--no-run")
    assert stated["bound"] == asked["bound"]
    assert stated["bound"]["proved"]
    # The options stand in place of the section.
    (other,) = json_of(
        *("stability", "stated.yaml", "--no-run", "--bound", "force=5@0,0,0.4"),
        *("--within-tilt", "0.25"),
    )
    found = other["bound"]
    assert (found["couple"], found["force"], found["tilt"]) == (None, 5.0, 0.25)


@pytest.mark.slow
def test_run_stores_the_proof_of_a_stated_bound_and_show_and_report_print_it(folder):
    (folder / "stated.yaml").write_text(STATED)
    without = ended(0, "run", "stated.yaml", "--no-prove").stdout
    assert "  Bound:       not decided: no proof of the stated bound is stored" in without
    said = "  Bound:       proved: any disturbance couple up to 60 N m keeps the tilt of this"
    assert said in ended(0, "run", "stated.yaml").stdout
    assert len(list((folder / "results" / "proofs").glob("bound-*.json"))) == 1
    assert said in ended(0, "show", "results/stated.h5").stdout
    (facts,) = json_of("run", "stated.yaml")
    assert facts["answers"]["bound"]["word"] == "proved"
    ended(0, "report", "results/stated.h5", "-o", "page.md")
    assert "tilt it far? **proved**. Any disturbance couple up to 60 N m" in (
        (folder / "page.md").read_text()
    )
    (proof,) = (folder / "results" / "proofs").glob("bound-*.json")
    assert "proof of a bound on disturbances" in ended(0, "show", str(proof)).stdout


def test_a_search_proves_no_stated_bound(folder):
    (folder / "stated.yaml").write_text(STATED)
    (facts,) = json_of("stability", "stated.yaml", "--search-only", "--no-run")
    assert facts["bound"] is None


def test_without_the_option_there_is_none(folder):
    (facts,) = json_of("stability", "good.yaml", "--no-run")
    assert facts["bound"] is None


REFUSED = {
    "--bound couple=100": "--bound has no effect without --within-tilt",
    "--within-tilt 0.5": "--within-tilt has no effect without --bound",
    "--largest": "--largest has no effect without --bound",
    "--bound couple=100 --within-tilt 1.6": "expected an angle above 0 and below π/2",
    "--bound couple=100 --within-tilt x": "expected an angle above 0 and below π/2",
    "--bound couple --within-tilt 1": "--bound couple: expected couple=N m or force=N, from 1e-",
    "--bound couple=1e300 --within-tilt 1": "couple=1e300: expected couple=N m or force=N, from ",
    "--bound couple=-1 --within-tilt 1": "--bound couple=-1: expected couple=N m or force=N",
    "--bound couple=nan --within-tilt 1": "--bound couple=nan: expected couple=N m or force=N",
    "--bound couple=1@0,0,0 --within-tilt 1": "a force acts at the centre of gravity, or at a poi",
    "--bound force=1@0,0 --within-tilt 1": "force=50@0.1,0,0.4",
    "--bound force=1 --bound force=2 --within-tilt 1": "at most one couple and one force",
    "--bound force=1 --within-tilt 1 --search-only": "--search-only cannot be combined with --bo",
}


@pytest.mark.parametrize("words", REFUSED)
def test_wrong_options_are_refused(folder, words):
    done = ended(2, "stability", "good.yaml", *words.split())
    assert REFUSED[words] in " ".join(done.stderr.split())


@pytest.mark.slow
def test_verify_checks_the_proof_of_a_stated_bound(folder):
    (folder / "stated.yaml").write_text(STATED)
    ended(0, "stability", "stated.yaml", "--no-run")
    (proof,) = (folder / "results" / "proofs").glob("bound-*.json")
    assert "Bound: checked (" in ended(0, "verify", str(proof), "--config", "stated.yaml").stdout
    both = ended(0, "verify", "results", "--config", "stated.yaml").stdout
    assert both.endswith("2 of 2 proofs verified\n")
    data = read_document(proof)
    data["claim"]["loads"][0]["size"] = "300"
    write_document(proof, data)
    done = ended(4, "verify", str(proof))
    assert "Bound: REFUSED" in done.stdout
    data["claim"]["version"] = 2
    write_document(proof, data)
    done = ended(5, "verify", str(proof), "--config", "stated.yaml")
    assert f"{proof}: not decided: this checker does not know claims of this ver" in done.stdout
    shown = ended(0, "show", str(proof)).stdout
    assert "It cannot be read: the claim has another version." in shown
