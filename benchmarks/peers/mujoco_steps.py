"""Peer: MuJoCo, a body with a free joint and its RK4 integrator, with the forces in a callback.

The callback `mjcb_passive` is called at each of the four stages of a step. (A force that is set
between the steps is constant during a step, which leaves a method of first order.)
"""

from collections.abc import Callable, Mapping
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import mujoco
import numpy as np
from equations import angles_of, make_forces, rotation_of

MODEL = """
<mujoco>
  <option gravity="0 0 0" integrator="RK4" timestep="{timestep!r}"/>
  <worldbody>
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
    </body>
  </worldbody>
</mujoco>
"""


def peer(problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Register the callback; return the function that makes a model with a time step."""
    forces = make_forces(problem)

    def apply_forces(_: Any, data: Any) -> None:
        state = _state(data.xmat[1], data.qpos, data.qvel)
        # Generalised forces of a free joint: the force, inertial, then the couple, body.
        data.qfrc_passive[:] = forces(np.sin(state[0:3]), np.cos(state[0:3]), state)

    def prepare(steps: float, members: int) -> Callable[[bool], Any]:
        # The compiler of models calls the callback too, with a body that has no attitude yet.
        mujoco.set_mjcb_passive(None)
        simulation = _Simulation(problem, int(steps))
        mujoco.set_mjcb_passive(apply_forces)
        return lambda _: np.array([simulation.motion(s) for s in problem["starts"][:members]])

    return prepare


def _state(rotation: Any, qpos: Any, qvel: Any) -> Any:
    """Return [Θ, Ω, X, V], shape (12,); a free joint has Ω in body and V in inertial axes."""
    Theta = angles_of(np, rotation.reshape(3, 3))
    return np.concatenate((Theta, qvel[3:6], qpos[0:3], qvel[0:3]))


class _Simulation:
    """A model with its data.

    Args:
        problem: The problem.
        steps: The number of time steps between two samples.
    """

    def __init__(self, problem: Mapping[str, Any], steps: int) -> None:
        times = problem["times"]
        timestep = (times[-1] - times[0]) / (len(times) - 1) / steps
        text = MODEL.format(timestep=timestep, mass=problem["mass"])
        self.steps, self.samples = steps, len(times)
        self.model = mujoco.MjModel.from_xml_string(text)
        # The compiler refuses the inertia (10, 8, 0.4), because 10 > 8 + 0.4. So it is set here.
        self.model.body_inertia[1] = problem["inertia"]
        self.data = mujoco.MjData(self.model)
        mujoco.mj_setConst(self.model, self.data)

    def motion(self, start: list[float]) -> Any:
        """Return the states of one member at all samples, shape (samples, 12)."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        Theta, Omega, X, V = np.split(np.array(start), 4)
        data.qpos[0:3] = X
        mujoco.mju_mat2Quat(data.qpos[3:7], rotation_of(np, Theta).flatten())
        data.qvel[0:3], data.qvel[3:6] = V, Omega
        states = [start]
        rotation = np.empty(9)
        for _ in range(self.samples - 1):
            mujoco.mj_step(model, data, nstep=self.steps)
            mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
            states.append(_state(rotation, data.qpos, data.qvel))
        return np.array(states)


if __name__ == "__main__":
    from serve import serve

    serve(peer, ("mujoco",))
