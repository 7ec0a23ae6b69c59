"""The expectations that a check states about a running launch."""
