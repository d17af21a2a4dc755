"""Passive elements: each states what it exerts, stores and dissipates, and how its states move.

Nothing else in the program knows an element's formulas. The Lyapunov function is the body's
kinetic energy plus what the elements store; its derivative is minus the sum of what they dissipate.
A new controller is one new file here.
"""
