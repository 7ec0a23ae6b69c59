"""The IPython extension, and everything that a student sees and uses in a notebook."""

from pathlib import Path

JUPYTER_SETTINGS = Path(__file__).with_name("jupyter")
"""JupyterLab's settings for students, without formgrader."""
