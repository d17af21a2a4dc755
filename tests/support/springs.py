"""A connector with any function of E, as a user could write it: with branches, or new functions."""

from dataclasses import dataclass, replace
from typing import Any

from rbstab.elements.element import Element, force_at_contact
from support.systems import random_system


@dataclass(frozen=True, eq=False)
class Spring(Element):
    """Λ = -k g(E)."""

    name = "connector"

    k: Any
    g: Any

    def wrench(self, motion, states):
        return force_at_contact(-self.k * self.g(motion.E))


def with_spring(rng, g):
    """Return a random free body with a spring."""
    system = random_system(rng, "free")
    return replace(system, elements=(*system.elements, Spring(700.0, g)))
