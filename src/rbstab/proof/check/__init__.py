"""A checker of proofs that shares nothing with the prover: python-flint and Python alone."""

from rbstab.proof.check.checker import check
from rbstab.proof.check.findings import Finding

__all__ = ["Finding", "check"]
