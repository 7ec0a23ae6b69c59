"""Runs submissions: each alone in the sandbox, many at once, and keeps what came of them."""
