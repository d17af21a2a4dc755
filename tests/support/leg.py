"""A leg on its knee: a held body above a joint, which a rotational spring holds upright; a body
that is held at its contact point without a load.
"""

BODY = {"mass": 3.5, "inertia": [0.059, 0.059, 0.006], "contact_point": [0, 0, -0.186]}

WEIGHT_MOMENT = 3.5 * 9.81 * 0.186
"""m g l, N m/rad: the leg stands upright if its spring is stiffer than this, 6.386."""


def leg(stiffness=10.0, **sections):
    """Return the config of a leg whose spring has this stiffness about x and y, N m/rad."""
    return {
        "schema_version": 2,
        "title": "A leg on its knee",
        "body": BODY,
        "gravity": [0, 0, -9.81],
        "controller": {
            "variant": "visco-elastic",
            "K_t": [1e-6, 1e-6, 1e-6],
            "L_t": [1e-6, 1e-6, 1e-6],
            "K_r": [stiffness, stiffness, stiffness / 2],
            "L_r": [0.8, 0.8, 0.3],
            "K_c": [4000, 4000, 40000],
            "L_c": [80, 80, 200],
        },
        "initial": {
            "orientation": {"deg": [5, 10, 0]},
            "angular_velocity": [0, 2, 0],
            "attached": True,
        },
        "integration": {"duration": 5},
    } | sections


def held(**initial):
    """Return the config of a body that is held at its contact point, without a load."""
    return {
        "body": {"mass": 12, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, -0.25]},
        "controller": {
            "variant": "permanent",
            "K_t": [40, 40, 40],
            "L_t": [8, 8, 8],
            "K_r": [60, 60, 30],
            "L_r": [6, 6, 3],
        },
        "initial": initial,
        "integration": {"duration": 4, "samples": 201},
    }


def held_leg(K_r=(5, 5, 2.5), elements=None, **sections):
    """Return the config of a leg that stands on its knee, which holds it."""
    return {
        "schema_version": 2,
        "body": BODY,
        "gravity": [0, 0, -9.81],
        "controller": {"variant": "permanent", "L_r": [0.8, 0.8, 0.3], "K_r": list(K_r)},
        "elements": elements or {},
        "integration": {"duration": 5},
    } | sections
