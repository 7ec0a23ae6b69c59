# This file runs in Python 3.6 and newer, so that an old Python prints a message and not a SyntaxError.
"""The lines that each Python of an environment with the kit runs first. This module imports nothing from the kit."""

FILE = "autograder.pth"
_NOT_LOOKED_FOR = (
    # Jupyter's programs import jsonschema. If it finds this module, it spends a second on a format that is not used.
    "import sys; sys.modules.setdefault('rfc3987_syntax', None)",
    # nbgrader puts the working folder, which may be a student's, before all others in the import path, and imports this
    # module before it reads any configuration.
    "import sys; 'nbgrader' in ' '.join(sys.orig_argv) and sys.modules.setdefault('argcomplete', None)",
)
TEXT = "".join(line + "\n" for line in _NOT_LOOKED_FOR)
