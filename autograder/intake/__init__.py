"""Read the submissions of a class from a learning platform: whose each file is, when it came, and what it replaces."""
