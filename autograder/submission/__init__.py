"""Turn a notebook into programs, files and check cells. Everything is read as text, and nothing is executed."""
