"""Protects the reasons why nothing is proved: older files have them in other words."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from support.configs import VISCO_ELASTIC, plain

from rbstab.config.load import load_config
from rbstab.experiment.answers.reasons import NOT_DAMPED, UNDECIDED
from rbstab.experiment.convergence.convergence import stored_convergence
from rbstab.experiment.proof_cache import cached_proof, proof_file
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import no_proof
from rbstab.proof.rest_points import SearchOutcome
from rbstab.store.document import write_document
from rbstab_cli.main import cli

OLD = {
    "some boxes could be neither emptied nor shown to hold one zero": UNDECIDED,
    "no elements damp every motion": NOT_DAMPED,
    "some motions may lose no energy, because no damper acts on them": NOT_DAMPED,
}


def test_the_reason_of_a_search_is_that_of_the_search() -> None:
    """Its module is not imported to read a file."""
    assert SearchOutcome.UNDECIDED.value == UNDECIDED


@pytest.mark.parametrize("old", OLD)
def test_the_reason_in_an_old_run(old: str) -> None:
    stored = f"no certified region is proved ({old}; rbstab run CONFIG --prove goes on)"
    found = stored_convergence({"convergence": "not decided", "convergence_reason": stored})
    assert found is not None
    assert found.why == (
        f"no certified region is proved ({OLD[old]}; rbstab run CONFIG --prove goes on)"
    )


@pytest.mark.parametrize("old", OLD)
def test_all_commands_show_the_reason_of_an_old_proof_in_new_words(
    old: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("body.yaml").write_text(VISCO_ELASTIC)
    config = load_config(plain(VISCO_ELASTIC))
    data = no_proof(proof_id(config), "").model_dump(mode="json") | {"outcome": old}
    file = proof_file(Path("results"), config)
    write_document(file, data)
    found = cached_proof(Path("results"), config)
    assert found is not None
    assert found.outcome == OLD[old]
    for words in (
        ("run", "body.yaml"),
        ("stability", "body.yaml", "--no-run"),
        ("show", "results/body.h5"),
        ("show", str(file)),
        ("show", str(file.parent)),
        ("report", "results", "--format", "text"),
    ):
        done = CliRunner().invoke(cli, words, env={"COLUMNS": "1000"})
        assert done.exit_code == 0, done.output
        assert old not in done.output
        assert OLD[old] in done.output
    # The file keeps its words.
    assert old in file.read_text()
