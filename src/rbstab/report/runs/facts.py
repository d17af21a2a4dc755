"""Facts on a run for several tables: certificate, proof, comparison with printed values."""

from collections.abc import Sequence
from dataclasses import dataclass

from rbstab.analysis.certificate.verdict import Check
from rbstab.experiment.answers.run_answer import RunAnswer
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import ReferenceValue, reference_values_of
from rbstab.report.reading.answers import RegionCheck, answers_of
from rbstab.report.reading.sources import Run


@dataclass(frozen=True, eq=False)
class RunFacts:
    """A run with its certificate, proof and comparisons.

    Args:
        run: The run.
        lines: The checks of its certificate, also those that a later proof decides.
        proof: The stored proof for its body, gravity and controller; None without one.
        region: The check of the certified region; None if there is none.
        convergence: What is proved of the exact motion; None for an older result.
        answer: What is known about stability, and how surely.
        comparisons: Printed values of the config's `reference`, each with the computed one.
    """

    run: Run
    lines: tuple[Check, ...]
    proof: Proof | None
    region: RegionCheck | None
    convergence: Convergence | None
    answer: RunAnswer
    comparisons: tuple[ReferenceValue, ...]

    def attribute(self, name: str) -> str:
        """Return an attribute of the result as text; "" if it is missing."""
        return str(self.run.result.attributes.get(name, ""))


def facts_of(runs: Sequence[Run]) -> tuple[RunFacts, ...]:
    """Return the facts of runs, in their order."""
    return tuple(_facts(run, _proof(run)) for run in runs)


def _facts(run: Run, proof: Proof | None) -> RunFacts:
    result, config = run.result, run.config
    reference = config.reference if config is not None else None
    comparisons = (
        reference_values_of(result, reference, run.summary) if reference is not None else []
    )
    known = run.known_answers or answers_of(result, config, proof)
    return RunFacts(
        run=run,
        lines=known.lines,
        proof=proof,
        region=known.region,
        convergence=known.convergence,
        answer=known.answer,
        comparisons=tuple(comparisons),
    )


def _proof(run: Run) -> Proof | None:
    """Return the proof stored beside a result."""
    return None if run.config is None else cached_proof(run.path.parent, run.config)
