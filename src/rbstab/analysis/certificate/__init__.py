"""The certificate of a run: checks of the Lyapunov argument along its trajectory.

A failed check shows an error in the equations, the gains or the integration. A passed check is an
observation on this run only; proofs for all motions are in `rbstab.proof`.

Every bound is relative to the size of the terms that were added up. If a comparison of numbers that
follow from one state fails in double precision, it is repeated in exact arithmetic
(`rbstab.analysis.exact`). So round-off alone never gives the verdict `violated`.
"""
