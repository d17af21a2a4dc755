"""Peer: Drake, a free body in a `MultibodyPlant` of continuous time, with the forces in a system.

The system of the forces is written in Python. It reads the state of the plant and returns
generalised forces, so Drake evaluates it at each stage of its integrator.
"""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import numpy as np
from equations import angles_of, make_forces, rotation_of
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

LARGEST_STEP = 0.1
"""Drake's own default, s."""


class Forces(LeafSystem):  # type: ignore[misc]
    """The stabilizers and the connector, from the state of the plant to its generalised forces."""

    def __init__(self, problem: Mapping[str, Any]) -> None:
        super().__init__()
        self.forces = make_forces(problem)
        self.state = self.DeclareVectorInputPort("state", 13)
        self.DeclareVectorOutputPort("forces", 6, self._compute)

    def _compute(self, context: Any, output: Any) -> None:
        A, state = _unpacked(self.state.Eval(context))
        loads = self.forces(np.sin(state[0:3]), np.cos(state[0:3]), state)
        # Generalised forces of a free body: the couple, then the force, both inertial.
        output.SetFromVector(np.concatenate((A @ loads[3:6], loads[0:3])))


def _unpacked(plant_state: Any) -> tuple[Any, Any]:
    """Return A and [Θ, Ω, X, V]; the plant has a quaternion, X, the inertial Ω, and V."""
    quaternion = plant_state[0:4]
    A = RotationMatrix(Quaternion(quaternion / np.sqrt(quaternion @ quaternion))).matrix()
    X, turning, V = plant_state[4:7], plant_state[7:10], plant_state[10:13]
    return A, np.concatenate((angles_of(np, A), A.T @ turning, X, V))


def peer(scheme: str, problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Return the function that builds a simulator with an accuracy."""

    def prepare(accuracy: float, members: int) -> Callable[[bool], Any]:
        simulator, plant = _simulator(problem)
        ResetIntegratorFromFlags(simulator, scheme, LARGEST_STEP)
        simulator.get_mutable_integrator().set_target_accuracy(accuracy)
        starts = problem["starts"][:members]
        return lambda _: np.array([_motion(simulator, plant, s, problem["times"]) for s in starts])

    return prepare


def _simulator(problem: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return a simulator of the body with its forces, and the plant in it."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(time_step=0.0))
    mass = problem["mass"]
    # Without the check, which refuses the inertia (10, 8, 0.4), because 10 > 8 + 0.4.
    inertia = UnitInertia(*(np.array(problem["inertia"]) / mass))
    plant.AddRigidBody("body", SpatialInertia(mass, np.zeros(3), inertia, True))
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    forces = builder.AddSystem(Forces(problem))
    builder.Connect(plant.get_state_output_port(), forces.get_input_port())
    builder.Connect(forces.get_output_port(), plant.get_applied_generalized_force_input_port())
    return Simulator(builder.Build()), plant


def _motion(simulator: Any, plant: Any, start: list[float], times: list[float]) -> Any:
    """Return the states of one member at all samples, shape (samples, 12)."""
    Theta, Omega, X, V = np.split(np.array(start), 4)
    A = rotation_of(np, Theta)
    quaternion = RotationMatrix(A).ToQuaternion().wxyz()
    context = simulator.get_mutable_context()
    context.SetTime(times[0])
    inner = plant.GetMyMutableContextFromRoot(context)
    plant.SetPositionsAndVelocities(inner, np.concatenate((quaternion, X, A @ Omega, V)))
    simulator.Initialize()
    states = []
    for time in times:
        simulator.AdvanceTo(time)
        states.append(_unpacked(plant.GetPositionsAndVelocities(inner))[1])
    return np.array(states)


if __name__ == "__main__":
    from serve import serve

    serve(partial(peer, sys.argv[1]), ("drake",))
