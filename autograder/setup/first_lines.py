# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
"""What each Python of an environment with the kit in it reads first. This module imports nothing of the kit."""

FILE = "autograder.pth"
_NOT_LOOKED_FOR = (
    # Jupyter's programs load jsonschema, which would build a grammar for one format of strings, unused here: a second.
    "import sys; sys.modules.setdefault('rfc3987_syntax', None)",
    # nbgrader puts the working folder before all others, which may be a student's, and looks for this module before it
    # reads any configuration.
    "import sys; 'nbgrader' in ' '.join(sys.orig_argv) and sys.modules.setdefault('argcomplete', None)",
)
TEXT = "".join(line + "\n" for line in _NOT_LOOKED_FOR)
