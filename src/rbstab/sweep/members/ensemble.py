"""The fast engine of members: whole shards through compiled batches.

A member that the batches do not follow to the end, or not within its step limit, is run once more
as a single run, which knows how it ends; so are members that slide or are projected. One that comes
so close to the end of the range that its samples cannot tell whether it left is integrated once
more alone, for its status.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.engine import integrate
from rbstab.integrate.heyoka.ensemble import Ensemble, Motions
from rbstab.integrate.heyoka.ensemble_forces import EnsembleForces
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.members.engine import MemberEngine, Shard, columns_of_failed
from rbstab.sweep.members.identity import run_ids
from rbstab.sweep.members.outcome import STATUSES, Traces, outcome_of
from rbstab.sweep.members.rest_energies import RestEnergies
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.members.traces import layout_of, put
from rbstab.sweep.plan.plan import Plan

SAMPLES = 512 * 201
"""Samples that are in memory at once (25 MB). Of fewer, threads wait for each other more often."""


def ensemble_engine(plan: Plan) -> MemberEngine:
    """The fast engine of a plan's members, for one thread."""
    return EnsembleEngine(plan, SingleRuns(plan, "heyoka"))


class EnsembleEngine:
    """Computes members in shards (a `MemberEngine`).

    Args:
        plan: The plan.
        alone: Runs members by themselves.
    """

    def __init__(self, plan: Plan, alone: MemberEngine) -> None:
        self.plan = plan
        self.alone = alone
        self.layout = layout_of(plan)
        self.structures = {
            variant: _Structure(plan, variant)
            for variant in plan.variants
            if _in_batches(problem_of(plan.base_of(variant)))
        }

    def compute(self, start: int, stop: int) -> Shard:
        """The members from number `start` up to `stop`."""
        values = self.plan.values(start, stop)
        members = stop - start
        found = columns_of_failed(members)
        found["run_id"] = run_ids(self.plan, start, stop)
        chosen = self.plan.keep.traces(start, stop)
        places = np.cumsum(chosen) - 1
        traces = self.layout.blank(int(chosen.sum())) if chosen.any() else None
        alone = np.ones(members, dtype=bool)
        for structure, chunk in self._chunks(values, members):
            given = {key: column[chunk] for key, column in values.items()}
            kept = np.flatnonzero(chosen[chunk])
            outcome, undecided, motions = structure.outcome(given, kept)
            if traces is not None:
                put(traces, places[chunk[kept]], motions.alike, kept)
                put(traces, places[chunk[kept]], motions.apart, np.arange(len(kept)))
            alone[chunk] = undecided
            for name, column in outcome.items():
                found[name][chunk] = column
        for row in np.flatnonzero(alone).tolist():
            member = start + row
            single = self.alone.compute(member, member + 1)
            for name, column in single.outcome.items():
                found[name][row] = column[0]
            if traces is not None and single.traces is not None:
                for name in self.layout.names:
                    traces[name][places[row]] = single.traces[name][0]
        return Shard(found, traces)

    def _chunks(
        self, values: dict[str, Array], members: int
    ) -> Iterator[tuple["_Structure", Array]]:
        """Rows of members of one structure, as many as are followed at once."""
        variants = values.get("controller.variant")
        for variant, structure in self.structures.items():
            of_variant = np.ones(members, bool) if variants is None else variants == variant
            rows = np.flatnonzero(of_variant)
            size = max(SIMD, SAMPLES // len(structure.problem.times) // SIMD * SIMD)
            for first in range(0, len(rows), size):
                yield structure, rows[first : first + size]


def _in_batches(problem: Problem) -> bool:
    """Whether nothing has to be done between the steps: no switching, no projection."""
    return problem.switching is None and not problem.project


class _Kept(NamedTuple):
    """Motions as traces name them: of all members, and what is evaluated of chosen ones alone."""

    alike: dict[str, Array | None]
    apart: dict[str, Array]


class _Structure:
    """The members of one variant: one set of equations."""

    def __init__(self, plan: Plan, variant: str) -> None:
        self.binding = Binding(plan, variant)
        self.problem = self.binding.problem
        problem, varies = self.problem, self.binding.varies
        self.ensemble = Ensemble(problem.system, problem.rtol, problem.times, varies)
        self.rest_energy = self._common_rest_energy()
        self.stored = RestEnergies(problem.system) if self.rest_energy is None else None
        keeps = plan.keep.count(plan.members)
        self.forces = EnsembleForces(self.ensemble) if keeps else None

    def _common_rest_energy(self) -> float | None:
        """The stored energy at rest, J, where all members share it."""
        varied = {column.path[0] for column in self.binding.columns}
        light = not any(self.binding.base.gravity) and "gravity" not in varied
        if varied <= {"initial"}:
            return nearest_rest_state(self.problem.system).energy
        # Without a load every unloaded position is at rest, and stores nothing.
        return 0.0 if light else None

    def outcome(
        self, values: dict[str, Array], kept: Array
    ) -> tuple[dict[str, Array], Array, "_Kept"]:
        """The columns of some members, and which of them have to be followed alone.

        Last come the motions; they stand until the next call.
        """
        parameters, starts = self.binding.of(values)
        motions = self.ensemble.run(parameters, starts)
        observed = self.ensemble.observe(parameters, motions)
        energy = observed[-1] - self._rest_energies(values, parameters)[:, np.newaxis]
        residual = energy - energy[:, :1] - motions.lyapunov_change
        traces = self._traces(motions.states, observed, energy, residual)
        with np.errstate(all="ignore"):
            outcome = outcome_of(traces)
            near = self._may_have_left(traces)
        outcome["status"] = np.full(len(near), STATUSES.index(RunStatus.COMPLETED))
        outcome["steps"] = motions.steps
        undecided = ~motions.done | (motions.steps > self.problem.step_limit)
        for k in np.flatnonzero(near & ~undecided).tolist():
            undecided[k] = integrate(self._problem(values, k)).status is not RunStatus.COMPLETED
        return outcome, undecided, self._kept(traces, parameters, motions, kept)

    def _kept(self, traces: Traces, parameters: Array, motions: Motions, rows: Array) -> "_Kept":
        if self.forces is None or not len(rows):
            return _Kept({}, {})
        forces = self.forces.along(parameters, motions, rows)
        alike = {
            "orientation": traces.Theta,
            "angular_velocity": traces.Omega,
            "position": traces.X,
            "velocity": traces.V,
            "connector_state": traces.own,
            "contact_displacement": traces.E,
            "contact_velocity": traces.F,
            "lyapunov": traces.value,
            "lyapunov_change": motions.lyapunov_change,
            "energy_residual": traces.residual,
        }
        apart = {"contact_force": np.moveaxis(forces[:3], 0, 2), "lyapunov_rate": forces[3]}
        return _Kept(alike, apart)

    def _rest_energies(self, values: dict[str, Array], parameters: Array) -> Array:
        if self.rest_energy is not None:
            return np.full(parameters.shape[1], self.rest_energy)
        assert self.stored is not None
        energies, found = self.stored.of(parameters)
        for k in np.flatnonzero(~found).tolist():
            energies[k] = nearest_rest_state(self._problem(values, k).system).energy
        return energies

    def _problem(self, values: dict[str, Array], k: int) -> Problem:
        """One of some members as a single run."""
        row = {key: column[k] for key, column in values.items() if key != "controller.variant"}
        return problem_of(self.binding.config_of(row))

    def _traces(self, states: Array, observed: Array, energy: Array, residual: Array) -> Traces:
        def along(rows: Array) -> Array:
            return np.moveaxis(rows, 0, 2)

        size = self.problem.system.coordinates.size
        return Traces(
            times=self.problem.times,
            Theta=along(states[0:3]),
            Theta_rate=along(observed[0:3]),
            Omega=along(states[3:6]),
            X=along(observed[3:6]),
            V=along(observed[6:9]),
            E=along(observed[9:12]),
            F=along(observed[12:15]),
            own=along(states[size:]) if len(states) > size else None,
            value=energy,
            residual=residual,
        )

    def _may_have_left(self, traces: Traces) -> Array:
        """Whether |θ2| may have come to the end of the range between samples, shape (m,)."""
        angle, rate = traces.Theta[..., 1], traces.Theta_rate[..., 1]
        h, end = np.diff(traces.times), math.acos(self.problem.range_bound)
        farthest = np.abs(angle).max(axis=1) + h.max() * np.abs(rate).max(axis=1)
        found = ~(farthest < end)
        # Few come that far; only they are looked at more closely.
        rows = np.flatnonzero(found)
        found[rows] = ~(_highest(angle[rows], rate[rows], h) < end)
        return found


def _highest(values: Array, rates: Array, h: Array) -> Array:
    """How far from zero samples of shape (m, n) and their rates let something come, shape (m,).

    The cubic between two samples stays inside the hull of its Bézier points. To that comes an
    eighth of what the rate changes by, times the interval: near the end of the range the motion is
    no cubic, but turns at a corner, which is at most where the tangents meet.
    """
    a, b, up, down = values[:, :-1], values[:, 1:], rates[:, :-1], rates[:, 1:]
    points = np.array([a, b, a + up * h / 3, b - down * h / 3])
    bent = np.abs(down - up) * h / 8
    return (np.abs(points).max(axis=0) + bent).max(axis=1)
