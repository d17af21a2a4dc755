"""Figures drawn by plotly, for the page."""
