"""Facts on a run for several tables: certificate, proof, comparison with printed values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rbstab.analysis.certificate import Check, Verdict
from rbstab.config.build import problem_of
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.answers.run_answer import RunAnswer, answer_beside
from rbstab.experiment.convergence.convergence import Convergence, stored_convergence
from rbstab.experiment.proof_cache import cached_proof, proof_file
from rbstab.experiment.run_certificate import proved_checks
from rbstab.experiment.stored_certificate import CertificateLine, certificate_lines
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.summary import ReferenceValue, reference_values_of
from rbstab.report.reading.sources import Run

REGION = "certified region"
"""Name of the check that a run starts in its certified region."""


@dataclass(frozen=True, eq=False)
class RunFacts:
    """A run with its certificate, proof and comparisons.

    Args:
        run: The run.
        lines: The checks of its certificate.
        proof: The stored proof for its body, gravity and controller; None without one.
        inside: Whether the run starts in its certified region; None if unknown.
        convergence: What is proved of the exact motion; None for an older result.
        answer: What is known about stability, and how surely.
        comparisons: Printed values of the config's `reference`, each with the computed one.
    """

    run: Run
    lines: tuple[CertificateLine, ...]
    proof: Proof | None
    inside: bool | None
    convergence: Convergence | None
    answer: RunAnswer
    comparisons: tuple[ReferenceValue, ...]

    def attribute(self, name: str) -> str:
        """Return an attribute of the result as text; "" if it is missing."""
        return str(self.run.result.attributes.get(name, ""))


def facts_of(runs: Sequence[Run]) -> tuple[RunFacts, ...]:
    """Return the facts of runs, in their order."""
    proofs: dict[Path, Proof | None] = {}
    return tuple(_facts(run, _proof(run, proofs)) for run in runs)


def _facts(run: Run, proof: Proof | None) -> RunFacts:
    result, config = run.result, run.config
    reference = config.reference if config is not None else None
    comparisons = (
        reference_values_of(result, reference, run.summary) if reference is not None else []
    )
    lines = tuple(certificate_lines(result))
    checks = _checks(run, lines, proof)
    return RunFacts(
        run=run,
        lines=lines,
        proof=proof,
        inside=_inside(lines, checks),
        convergence=stored_convergence(result.attributes),
        answer=answer_beside(result, config, proof, checks),
        comparisons=tuple(comparisons),
    )


def _proof(run: Run, cached: dict[Path, Proof | None]) -> Proof | None:
    """Return the proof stored beside a result; runs may share it."""
    if run.config is None:
        return None
    path = proof_file(run.path.parent, run.config)
    if path not in cached:
        cached[path] = cached_proof(run.path.parent, run.config)
    return cached[path]


def _checks(
    run: Run, lines: Sequence[CertificateLine], proof: Proof | None
) -> list[Check] | None:
    """Return what a proof decides that was stored after a run; None if the certificate has it."""
    stored = [line.value for line in lines if line.check == REGION]
    if (stored and not math.isnan(stored[0])) or proof is None:
        return None
    # The regions would need the equations, and a stored result must not run code of a user.
    if run.config is None or has_code(run.config):
        return None
    return proved_checks(problem_of(run.config), proof)


def _inside(lines: Sequence[CertificateLine], checks: Sequence[Check] | None) -> bool | None:
    """Return whether a run starts in its certified region; None if unknown.

    The certificate decides. If it was written without a proof, a proof stored since then decides.
    """
    stored = [(line.verdict, line.value) for line in lines if line.check == REGION]
    if checks is not None:
        stored = [(str(check.verdict), check.value) for check in checks if check.name == REGION]
    if not stored or math.isnan(stored[0][1]):
        return None
    return stored[0][0] == Verdict.CERTIFIED
