"""Figures as Vega-Lite: one description, which pages and files of figures draw."""
