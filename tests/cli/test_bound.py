"""Protects `rbstab stability --bound`."""

import pytest
from cli.conftest import GOOD, ended, json_of

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
