"""The equations of a system as a Python function of floats, made by tracing the equations once."""
