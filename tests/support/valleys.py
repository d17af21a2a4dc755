"""A body with two minima of the energy, for proofs that tell one from the other."""

from typing import Any

TWO_VALLEYS: dict[str, Any] = {
    "body": {"mass": 1.0, "inertia": [1, 1, 1], "contact_point": [0, 0, -1]},
    "gravity": [0, 20, -100],
    "controller": {
        "variant": "permanent",
        "K_r": [50, 300, 300],
        "L_r": [20, 20, 20],
        "K_t": [1e-6, 1e-6, 1e-6],
        "L_t": [1, 1, 1],
    },
    "initial": {"orientation": [0, 0, 0]},
    "integration": {"duration": 60.0, "samples": 61},
}
"""A body on soft springs under a tilted weight: two valleys, the deeper one at θ1 < 0."""
