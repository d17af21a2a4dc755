"""Peer: diffrax, all members at once by `jax.vmap`, on the processor and in double precision."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

if __name__ == "__main__":
    from serve import pin_to_core

    pin_to_core()

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from equations import make_rates

jax.config.update("jax_enable_x64", True)


def peer(problem: Mapping[str, Any]) -> Callable[[float, int], Callable[[bool], Any]]:
    """Return the function that compiles the integration of a number of members."""
    rates = make_rates(jnp, problem)
    times = jnp.array(problem["times"])
    term = diffrax.ODETerm(lambda t, y, _: rates(t, y))

    def motion(start: Any, tolerance: Any) -> Any:
        solution = diffrax.diffeqsolve(
            term,
            diffrax.Tsit5(),
            t0=times[0],
            t1=times[-1],
            dt0=None,
            y0=start,
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=10_000,
        )
        return solution.ys

    batch = jax.jit(jax.vmap(motion, in_axes=(0, None)))

    @cache
    def compiled(members: int) -> Any:
        return batch.lower(jnp.array(problem["starts"][:members]), jnp.float64(0.0)).compile()

    def prepare(tolerance: float, members: int) -> Callable[[bool], Any]:
        # The tolerance is an argument, so only a new number of members is compiled.
        integrate, starts = compiled(members), jnp.array(problem["starts"][:members])
        return lambda _: np.asarray(integrate(starts, jnp.float64(tolerance)))

    return prepare


if __name__ == "__main__":
    from serve import serve

    serve(peer, ("diffrax", "jax", "jaxlib"))
