"""A run as plain data for JSON."""

from typing import TYPE_CHECKING, Any

from rbstab.config.schema import Config
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.answers.words import word_of
from rbstab.experiment.convergence.convergence import ATTRIBUTE, stored_convergence
from rbstab.experiment.summary import summary_of
from rbstab.store.result import Result

if TYPE_CHECKING:
    # A run without a proof imports none of it.
    from rbstab.experiment.stored_proof.proof import Proof


def run_data(result: Result, config: Config | None, proof: "Proof | None" = None) -> dict[str, Any]:
    """Return the outcome of a result, its attributes, summary, answers and convergence.

    Args:
        result: The result.
        config: Its config; None if this version cannot read it.
        proof: The proof of its rest states, if there is one.
    """
    answer = answer_of(result, config, proof)
    data: dict[str, Any] = {"outcome": answer.outcome.as_data()} | {
        name: value
        for name, value in result.attributes.items()
        if name.partition("_")[0] != ATTRIBUTE
    }
    data["checks"] = word_of(str(data.get("verdict", "-")))
    data["warnings"] = str(data.get("warnings", "")).splitlines()
    convergence = stored_convergence(result.attributes)
    data[ATTRIBUTE] = None if convergence is None else convergence.as_data()
    data["answers"] = {
        question: {"word": str(found.sureness), "sentence": found.sentence}
        for question, found in answer.answers.items()
    }
    return {**data, **summary_of(result)._asdict()}
