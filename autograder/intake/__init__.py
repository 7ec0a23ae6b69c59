"""What comes out of a learning platform: which file is whose submission, when it came, and what it replaces."""
