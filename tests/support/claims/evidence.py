"""Doubts about claims: what searches in plain doubles find that contradicts them.

The searches know nothing of the proofs. They use the stored energy alone, and differences of it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, root

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from support.claims.compare import RANGES
from support.claims.program import Claims
from support.systems import Array

STARTS = 60
STEP = 1e-5
"""Of differences of energy, in rad and m."""

SAME = 1e-3
"""rad: how far a state that is found may be from one that is claimed."""

HALF_TURN = np.array([np.pi, np.pi / 2, np.pi])


def doubts(config: Config, claims: Claims, seed: int = 0) -> dict[str, str]:
    """Return what contradicts the claims about a config: by claim, in words.

    Args:
        config: The config.
        claims: The claims about it.
        seed: Of the random starts.
    """
    found: dict[str, str] = {}
    if not claims["passive"]:
        return found
    search = _Search.of(config, np.random.default_rng(seed))
    with np.errstate(all="ignore"):
        for claim, text in search.contradictions(claims):
            found.setdefault(claim, text)
    return found


@dataclass(frozen=True, eq=False)
class _Search:
    """The stored energy of a body at rest, random numbers, and the largest |θ2|."""

    at_rest: Configurations
    rng: np.random.Generator
    pitch: float
    kept: bool
    """Whether a barrier or a stop keeps θ2 in the range."""

    outer: bool
    """Whether barriers keep θ1 and θ3 too."""

    jumps: bool
    """Whether forces jump or stops press, so that a state need be no zero of the slope."""

    turns: bool
    """Whether the energy changes with whole turns."""

    size: Array

    @classmethod
    def of(cls, config: Config, rng: np.random.Generator) -> "_Search":
        sections = [section.model_dump() for section in config.elements.values()]
        guards = {section.get("method"): section for section in sections}
        kinked = {"Latch", "Counterweight"}
        at_rest = configurations(smooth_rest_system(problem_of(config)))
        K_r = getattr(config.controller, "K_r", None)
        turns = K_r is not None and bool(np.any(np.asarray(K_r)))
        outer = bool(guards.get("barrier", {}).get("outer_stiffness"))
        stop = guards.get("stop", {}).get("angle")
        jumps = stop is not None or "repelling" in guards
        jumps |= any(section.get("class_") in kinked or section.get("class") in kinked
                     for section in sections)  # fmt: skip
        return cls(
            at_rest,
            rng,
            float(stop or np.pi / 2),
            stop is not None or "barrier" in guards,
            outer,
            bool(jumps),
            turns,
            np.ones(at_rest.size),
        )

    def energy(self, q: Array) -> float:
        return float(self.at_rest.energy(np.asarray(q, dtype=float)))

    def slope(self, q: Array) -> Array:
        """Return central differences of the energy."""
        steps = STEP * np.eye(len(q))
        return np.array([(self.energy(q + h) - self.energy(q - h)) / (2 * STEP) for h in steps])

    def hessian(self, q: Array) -> Array:
        h = 1e-4 * np.eye(len(q))
        n = range(len(q))
        found = np.zeros((len(q), len(q)))
        for i in n:
            for j in n[: i + 1]:
                four = [self.energy(q + a * h[i] + b * h[j]) for a in (1, -1) for b in (1, -1)]
                found[i, j] = found[j, i] = (four[0] - four[1] - four[2] + four[3]) / 4e-8
        return found

    def start(self, end: Array) -> Array:
        """Return a random configuration with its lowest energy at these angles."""
        Theta = self.rng.uniform(-1, 1, 3) * end
        return np.concatenate([Theta, self.lowest_rest(Theta)])

    def lowest_rest(self, Theta: Array) -> Array:
        """Return X and own states of the lowest energy at given angles."""
        if self.at_rest.size == 3:
            return np.zeros(0)
        guess = self.at_rest.unloaded[3:]
        found = minimize(lambda x: self.energy(np.concatenate([Theta, x])), guess, method="BFGS")
        return found.x

    def contradictions(self, claims: Claims) -> Iterator[tuple[str, str]]:
        """Yield claims with what contradicts them."""
        for name in RANGES:
            part = claims[name]
            if part is None:
                continue
            end = np.array([np.pi, self.pitch, np.pi])
            if name == "all_angles":
                end *= [2.0, 1.0, 2.0]
            yield from ((name, text) for text in self._of_states(part))
            yield from ((name, text) for text in self._of_list(part, end))
            yield from ((name, text) for text in self._of_level(name, part))
        yield from self._of_sum(claims)

    def _of_states(self, part: Claims) -> Iterator[str]:
        """Compare the energy, slope and index of each proved state with those of differences."""
        for state in part["states"]:
            if not state["proved"] or "held" in state["kind"] or "ridge" in state["kind"]:
                continue
            Theta = np.array(state["at"])
            q = np.concatenate([Theta, self.lowest_rest(Theta)])
            scale = max(1.0, abs(state["energy"]))
            if abs(self.energy(q) - state["energy"]) > 1e-5 * scale:
                yield f"U is {self.energy(q):.6g} J at {state['at']}"
            curvature = self.hessian(q)
            values = np.linalg.eigvalsh(curvature)
            sure = np.abs(values).min() > 1e-4 * np.abs(values).max()
            if sure and state["index"] is not None and np.sum(values < 0) != state["index"]:
                yield f"the index is {np.sum(values < 0)} at {state['at']}"
            if np.abs(self.slope(q)[:3]).max() > 1e-3 * np.abs(values).max():
                yield f"U has a slope at {state['at']}"

    def _of_list(self, part: Claims, end: Array) -> Iterator[str]:
        """Look for states that are not listed: all that are found count against the list."""
        if not part["complete"] and part["level"] is None:
            return
        for number in range(STARTS):
            q = self.start(end) if number % 2 else self._descended(self.start(end), end)
            if not self.jumps:
                q = root(self.slope, q, method="hybr", tol=1e-10).x
            else:
                q = self._descended(q, end)
            Theta = q[:3]
            inside = np.all(np.abs(Theta) < end - 1e-3)
            flat = np.abs(self.slope(q)).max() < 1e-4 * max(1.0, np.abs(self.energy(q)))
            if not (inside and flat) or self._listed(Theta, part):
                continue
            if not self._sharp(q):
                continue
            U = self.energy(q)
            if part["complete"]:
                yield f"another state was found, at {np.round(Theta, 6).tolist()}, {U:.6g} J"
                return
            lowest = part["states"][0]["energy"]
            if U - lowest < part["level"] * (1 - 1e-6):
                yield f"a state below c* was found, at {np.round(Theta, 6).tolist()}, {U:.6g} J"
                return

    def _descended(self, q: Array, end: Array) -> Array:
        limits = [(-one, one) for one in end - 1e-9] + [(None, None)] * (len(q) - 3)
        found = minimize(self.energy, q, jac=self.slope, bounds=limits, method="L-BFGS-B")
        return np.asarray(found.x)

    def _sharp(self, q: Array) -> bool:
        """Return whether the energy is a smooth function with a slope of zero near q."""
        values = np.linalg.eigvalsh(self.hessian(q))
        if np.abs(values).min() < 1e-6 * np.abs(values).max():
            return False
        again = root(self.slope, q, method="hybr", tol=1e-11).x
        return bool(np.abs(again - q).max() < 1e-4)

    def _listed(self, Theta: Array, part: Claims) -> bool:
        others = [np.array(state["at"]) for state in part["states"]]
        if self.turns or self.outer:
            return any(np.abs(Theta - other).max() < SAME for other in others)
        return any(
            np.abs((Theta - other + np.pi) % (2 * np.pi) - np.pi).max() < SAME for other in others
        )

    def _of_level(self, name: str, part: Claims) -> Iterator[str]:
        """Look for a point of the border that is below c*: by samples and descents on each face."""
        if part["level"] is None:
            return
        bound = part["states"][0]["energy"] + part["level"]
        axes = [1] if name == "all_angles" or not self.turns else [0, 1, 2]
        axes = [axis for axis in axes if not (axis == 1 and self.kept)]
        ends = HALF_TURN * (2.0 if name == "all_angles" else 1.0)
        ends[1] = np.pi / 2 - 1e-9
        for axis in axes:
            for sign in (-1.0, 1.0):
                least = min(self._lowest_on(axis, sign * ends[axis], ends) for _ in range(3))
                if least < bound - 1e-6 * max(1.0, abs(bound)):
                    yield f"U is {least:.6g} J on the border of θ{axis + 1}, below c*"

    def _lowest_on(self, axis: int, value: float, ends: Array) -> float:
        samples = []
        for _ in range(30 if self.at_rest.size == 3 else 6):
            q = self.start(ends)
            q[axis] = value
            samples.append(q)
        q = min(samples, key=self.energy)
        limits = [(-one, one) for one in ends] + [(None, None)] * (len(q) - 3)
        limits[axis] = (value, value)
        return float(
            minimize(self.energy, q, jac=self.slope, bounds=limits, method="L-BFGS-B").fun
        )

    def _of_sum(self, claims: Claims) -> Iterator[tuple[str, str]]:
        """Count the states: Σ (-1)^index is Euler's number of the space where θ2 is kept."""
        name = "range" if self.outer else "all_angles"
        part = claims[name]
        if not self.kept or part is None or not part["complete"]:
            return
        if any(state["index"] is None for state in part["states"]):
            return
        total = sum((-1) ** state["index"] for state in part["states"])
        wanted = 1 if self.turns or self.outer else 0
        if total != wanted:
            yield name, f"Σ (-1)^index is {total}, not {wanted}"
