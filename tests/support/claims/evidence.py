"""Doubts about claims: what searches in plain doubles find that contradicts them.

The searches know nothing of the proofs. They use the stored energy alone, and differences of it.
"""

from itertools import chain

import numpy as np
from scipy.optimize import minimize, root

from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of
from support.bodies import least_energy
from support.claims.compare import RANGES
from support.differences import hessian

HELD_STARTS, STARTS = 60, 20
"""Random starts of a search for more states: of a body that is held, and of one that is not."""

STEP = 1e-5
"""Of differences of energy, in rad and m."""

SAME = 1e-3
"""rad: how far a state that is found may be from one that is claimed."""


def doubts(config, claims, seed=0):
    """Return what contradicts the claims about a config: by claim, in words.

    Args:
        config: The config.
        claims: The claims about it.
        seed: Of the random starts.
    """
    doubted: dict[str, str] = {}
    if not claims["passive"]:
        return doubted
    search = _Search(config, np.random.default_rng(seed))
    with np.errstate(all="ignore"):
        for claim, text in search.contradictions(claims):
            doubted.setdefault(claim, text)
    return doubted


class _Search:
    """Searches with the stored energy of a body at rest alone, from random starts."""

    def __init__(self, config, rng):
        self.rng = rng
        self.at_rest = configurations(smooth_rest_system(problem_of(config)))
        sections = [section.model_dump() for section in config.elements.values()]
        guards = {section.get("method"): section for section in sections}
        stop = guards.get("stop", {}).get("angle")
        self.stopped = stop is not None
        """Whether a stop keeps |θ2| <= pitch."""
        self.pitch = float(stop or np.pi / 2)
        """The largest |θ2|."""
        self.kept = self.stopped or "barrier" in guards
        """Whether a barrier or a stop keeps θ2 in the range."""
        self.outer = bool(guards.get("barrier", {}).get("outer_stiffness"))
        """Whether barriers keep θ1 and θ3 too."""
        names = {section.get("class_name") for section in sections}
        self.jumps = "repelling" in guards or bool(names & {"Latch", "Counterweight"})
        """Whether forces jump, so that a state need be no zero of the slope."""
        K_r = getattr(config.controller, "K_r", None)
        self.turns = K_r is not None and bool(np.any(np.asarray(K_r)))
        """Whether the energy changes with whole turns."""

    def energy(self, q):
        return float(self.at_rest.energy(np.asarray(q, dtype=float)))

    def slope(self, q):
        """Return central differences of the energy."""
        steps = STEP * np.eye(len(q))
        return np.array([(self.energy(q + h) - self.energy(q - h)) / (2 * STEP) for h in steps])

    def start(self, end):
        """Return a random configuration with its lowest energy at these angles."""
        Theta = self.rng.uniform(-1, 1, 3) * end
        return np.concatenate([Theta, self.lowest_rest(Theta)])

    def lowest_rest(self, Theta):
        """Return X and own states of the lowest energy at given angles."""
        if self.at_rest.size == 3:
            return np.zeros(0)
        guess = self.at_rest.unloaded[3:]
        solution = minimize(lambda x: self.energy(np.concatenate([Theta, x])), guess, method="BFGS")
        return solution.x

    def contradictions(self, claims):
        """Yield claims with what contradicts them."""
        for name in RANGES:
            part = claims[name]
            if part is None:
                continue
            end = np.array([np.pi, self.pitch, np.pi])
            if name == "all_angles":
                end *= [2.0, 1.0, 2.0]
            texts = (
                self._of_states(part),
                self._of_list(part, end),
                self._of_level(name, part, end),
            )
            yield from ((name, text) for text in chain(*texts))
        yield from self._of_sum(claims)

    def _of_states(self, part):
        """Compare the energy, slope and index of each proved state with those of differences."""
        for state in part["states"]:
            if not state["proved"] or "held" in state["kind"] or "ridge" in state["kind"]:
                continue
            Theta = np.array(state["at"])
            q = np.concatenate([Theta, self.lowest_rest(Theta)])
            scale = max(1.0, abs(state["energy"]))
            if abs(self.energy(q) - state["energy"]) > 1e-5 * scale:
                yield f"U is {self.energy(q):.6g} J at {state['at']}"
            curvature = hessian(self.energy, q)
            values = np.linalg.eigvalsh(curvature)
            sure = np.abs(values).min() > 1e-4 * np.abs(values).max()
            if sure and state["index"] is not None and np.sum(values < 0) != state["index"]:
                yield f"the index is {np.sum(values < 0)} at {state['at']}"
            if np.abs(self.slope(q)[:3]).max() > 1e-3 * np.abs(values).max():
                yield f"U has a slope at {state['at']}"

    def _of_list(self, part, end):
        """Look for states that are not listed: all that are found count against the list."""
        if not part["complete"] and part["level"] is None:
            return
        for number in range(HELD_STARTS if self.at_rest.held else STARTS):
            q = self.start(end)
            if number % 2:
                q = root(self.slope, q, method="hybr", tol=1e-10).x
            else:
                q = self._descended(q, end)
            if self._listed(q[:3], part) or not self._is_state(q, end):
                continue
            U, at = self.energy(q), np.round(q[:3], 6).tolist()
            if part["complete"]:
                yield f"another state was found, at {at}, {U:.6g} J"
                return
            if U - part["states"][0]["energy"] < part["level"] * (1 - 1e-6):
                yield f"a state below c* was found, at {at}, {U:.6g} J"
                return

    def _is_state(self, q, end):
        """Return whether a body rests at q, inside the range or pressed against its stop."""
        free = np.ones(len(q), dtype=bool)
        if self.stopped and abs(abs(q[1]) - self.pitch) < 1e-6:
            free[1] = False
            outward = self.slope(q - [0, np.sign(q[1]) * 1e-4, *np.zeros(len(q) - 2)])[1]
            if outward * q[1] > 0:
                return False
        if not np.all((np.abs(q[:3]) < end - 1e-3) | ~free[:3]):
            return False
        return self._flat(q, free) or (self.jumps and self._lowest_near(q))

    def _flat(self, q, free):
        """Return whether U is smooth at q, with a slope of zero and no degenerate curvature."""
        U, steps = self.energy(q), 1e-6 * np.eye(len(q))
        sides = [(self.energy(q + h) - U, self.energy(q - h) - U) for h in steps[free]]
        values = np.linalg.eigvalsh(hessian(self.energy, q)[np.ix_(free, free)])
        least, most = np.abs(values).min(), np.abs(values).max()
        if least < 1e-6 * most:
            return False
        return bool(np.abs(sides).max() < 1e-6 * 1e-3 * max(1.0, abs(U)))

    def _lowest_near(self, q):
        """Return whether a search without slopes ends at q: it does at a kink that holds."""
        again = q
        for _ in range(3):
            options = {"xatol": 1e-10, "fatol": 1e-14, "maxfev": 4000}
            again = minimize(self.energy, again, method="Nelder-Mead", options=options).x
        return bool(np.abs(again - q).max() < SAME)

    def _descended(self, q, end):
        limits = [(-high, high) for high in end - 1e-9] + [(None, None)] * (len(q) - 3)
        lowest = minimize(self.energy, q, jac=self.slope, bounds=limits, method="L-BFGS-B").x
        near = root(self.slope, lowest, method="hybr", tol=1e-10).x
        return np.asarray(near if np.abs(near - lowest).max() < SAME else lowest)

    def _listed(self, Theta, part):
        apart = np.array([Theta - np.array(state["at"]) for state in part["states"]]).reshape(-1, 3)
        if not (self.turns or self.outer):
            apart = (apart + np.pi) % (2 * np.pi) - np.pi
        return bool(np.any(np.all(np.abs(apart) < SAME, axis=-1)))

    def _of_level(self, name, part, end):
        """Look for another state or a point of the border below c*: by descents on each face."""
        if part["level"] is None:
            return
        bound = part["states"][0]["energy"] + part["level"]
        for state in part["states"][1:]:
            if state["energy"] < bound - 1e-6 * max(1.0, abs(bound)):
                yield f"the state at {state['at']} is below c*"
        axes = [1] if name == "all_angles" or not self.turns else [0, 1, 2]
        axes = [axis for axis in axes if not (axis == 1 and self.kept)]
        ends = end - [0, 1e-9, 0]
        for axis in axes:
            for sign in (-1.0, 1.0):
                starts = 90 if self.at_rest.size == 3 else 20
                at = sign * ends[axis]
                least = least_energy(self.at_rest, axis, at, self.rng, starts, end=ends)
                if least < bound - 1e-6 * max(1.0, abs(bound)):
                    yield f"U is {least:.6g} J on the border of θ{axis + 1}, below c*"

    def _of_sum(self, claims):
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
