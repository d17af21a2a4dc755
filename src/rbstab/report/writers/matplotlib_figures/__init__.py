"""Figures drawn by matplotlib, for PDF and Markdown."""
