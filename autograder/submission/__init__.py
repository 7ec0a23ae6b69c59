"""Turns a notebook into programs, files and check cells, as text and without running any of it."""
