"""Does nothing wrong."""

print("fine")
