"""The walls around a student's programs, and the launcher that starts them."""
