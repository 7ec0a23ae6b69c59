"""Keeps a student's programs away from the checks, the machine and other students."""
