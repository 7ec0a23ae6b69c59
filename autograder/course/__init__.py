"""A course: its folders, its settings, its labs and the cells of their notebooks."""
