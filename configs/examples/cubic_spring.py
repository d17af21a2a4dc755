"""A spring whose force grows with the cube of its extension: an element for `kind: python`."""

from rbstab.elements import Element, Gain, force_at_centre, power


class CubicSpring(Element):
    """A force -k x³ along each inertial axis, on the centre of gravity."""

    # The parameters of a config: name, unit and meaning. A shape is "number", "diagonal" (three
    # numbers) or "matrix". Each is a field of the element: self.k.
    gains = (Gain("k", "N/m^3", "force by the cube of a displacement", shape="diagonal"),)

    # The statements take the motion of the body: Theta, Omega, X, V, A, B, E and F (all arrays of
    # numpy). They must not branch on a value: floats, complex numbers, symbols and balls pass.
    def wrench(self, motion, states):
        """Force (N, inertial) and couple (N m, body coordinates) on the body."""
        return force_at_centre(-self.k * power(motion.X, 3))

    def stored(self, motion, states):
        """The energy ¼ Σ k x⁴, J: the force is minus its slope."""
        return 0.25 * (self.k @ power(motion.X, 4))

    # An element that damps has a third statement, dissipated(self, motion, states): the power, W,
    # that its wrench takes out of the motion.
