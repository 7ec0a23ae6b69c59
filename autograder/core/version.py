"""The kit's version, which stands in every result; the wheel takes its own from here."""

VERSION = "0.2.0"
