"""Tools for the authors of a course: create courses and labs, lint and release them, and mutate their solutions."""
