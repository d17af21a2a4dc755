"""Figures drawn by plotly, for HTML pages."""
