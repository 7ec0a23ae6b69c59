"""The kit's version. It is stored in every result, and the wheel's version is read from here."""

VERSION = "0.2.0"
