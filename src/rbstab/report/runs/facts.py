"""Facts on a run for several tables: certificate, proof, comparison with printed values."""

from collections.abc import Sequence
from dataclasses import dataclass

from rbstab.experiment.answers.run_answer import RunAnswer
from rbstab.experiment.convergence.convergence import Convergence, stored_convergence
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_certificate import CertificateLine, certificate_lines
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import ReferenceValue, reference_values_of
from rbstab.report.reading.answers import answers_of
from rbstab.report.reading.sources import Run


@dataclass(frozen=True, eq=False)
class RunFacts:
    """A run with its certificate, proof and comparisons.

    Args:
        run: The run.
        lines: The checks of its certificate.
        proof: The stored proof for its body, gravity and controller; None without one.
        inside: Whether the run starts in its certified region; None if unknown.
        margin: v(0) over the level of this region, both from its rest state; None if unknown.
        convergence: What is proved of the exact motion; None for an older result.
        answer: What is known about stability, and how surely.
        comparisons: Printed values of the config's `reference`, each with the computed one.
    """

    run: Run
    lines: tuple[CertificateLine, ...]
    proof: Proof | None
    inside: bool | None
    margin: float | None
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
    answer, inside, margin = run.known_answers or answers_of(result, config, proof)
    return RunFacts(
        run=run,
        lines=tuple(certificate_lines(result)),
        proof=proof,
        inside=inside,
        margin=margin,
        convergence=stored_convergence(result.attributes),
        answer=answer,
        comparisons=tuple(comparisons),
    )


def _proof(run: Run) -> Proof | None:
    """Return the proof stored beside a result."""
    return None if run.config is None else cached_proof(run.path.parent, run.config)
