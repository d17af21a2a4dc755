"""A continuum of rest states is told from single ones, however soft these are."""

import numpy as np
import pytest

from rbstab.analysis.proof.branch_and_bound import SearchOutcome, prove
from rbstab.analysis.proof.searches.families import is_family
from rbstab.analysis.proof.searches.zeros import search
from rbstab.analysis.proof.trigonometric import TrigonometricForm


@pytest.mark.parametrize(
    ("soft", "outcome"),
    [(0.0, SearchOutcome.FAMILY), (1e-7, SearchOutcome.PROVED), (1e-4, SearchOutcome.PROVED)],
)
def test_one_angle_without_stiffness_is_a_family(soft, outcome):
    """U = 5 θ1² + 5 θ2² + ½ soft θ3²: without stiffness all (0, 0, θ3) are at rest."""
    form = TrigonometricForm(np.diag([10.0, 10.0, soft]), np.zeros(3), np.zeros((1, 1, 1)))
    found = search(form)
    assert is_family(form, list(found)) == (outcome is SearchOutcome.FAMILY)
    zeros = prove(form, found)
    assert zeros.outcome is outcome
    assert len(zeros.inside) == (outcome is SearchOutcome.PROVED)
    assert zeros.examined < 20_000
