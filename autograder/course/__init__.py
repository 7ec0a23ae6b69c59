"""A course: its folder, its labs, the marks in their notebooks."""
