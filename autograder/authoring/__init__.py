"""What who writes a course needs."""
