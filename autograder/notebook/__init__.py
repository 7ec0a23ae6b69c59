"""The IPython extension: what a student sees and uses in a notebook."""
