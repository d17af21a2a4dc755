"""A run as plain data for JSON."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.store.result import Result


def run_data(result: "Result", proof: "Proof | None" = None) -> dict[str, Any]:
    """Return the attributes and the summary of a result, with its answers and its convergence.

    Args:
        result: The result.
        proof: The proof of its rest states, if there is one.
    """
    from rbstab.experiment.answers.run_answer import answer_of
    from rbstab.experiment.answers.words import word_of
    from rbstab.experiment.convergence.convergence import ATTRIBUTE, stored_convergence
    from rbstab.experiment.summary import summary_of

    data: dict[str, Any] = {
        name: value
        for name, value in result.attributes.items()
        if name.partition("_")[0] != ATTRIBUTE
    }
    data["checks"] = word_of(str(data.get("verdict", "-")))
    data["warnings"] = str(data.get("warnings", "")).splitlines()
    found = stored_convergence(result.attributes)
    data[ATTRIBUTE] = None if found is None else found.as_data()
    data["answers"] = {
        question: {"word": str(answer.sureness), "sentence": answer.sentence}
        for question, answer in answer_of(result, proof)._asdict().items()
    }
    return {**data, **summary_of(result)._asdict()}
