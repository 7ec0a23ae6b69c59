"""The kit's version; it stands in every result."""

VERSION = "0.1.0"
