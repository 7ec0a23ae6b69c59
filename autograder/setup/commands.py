# Written for Python 3.6 and up, so that an old Python meets a sentence and not a SyntaxError.
"""The commands of a checkout's environment: `autograder`, and `ros2` where none is installed; a wheel brings them."""

from autograder.setup.places import VENV

# A #! line can hold no space and is cut at 127 bytes: /bin/sh starts the Python that lies beside this file.
# Guarded, since processes of a pool import the main script once more.
_COMMAND = (
    '#!/bin/sh\n\'\'\'exec\' "$(dirname "$(readlink -f "$0")")/python" "$0" "$@"\n\' \'\'\'\n'
    "import sys\n\nfrom autograder.cli import %s\n\nif __name__ == '__main__':\n    sys.exit(%s())\n"
)


def write_commands() -> None:
    """Write those that are missing or of an earlier form."""
    for name, function in (("autograder", "main"), ("ros2", "ros2")):
        command = VENV / "bin" / name
        text = _COMMAND % (function, function)
        if not command.exists() or command.read_text(encoding="utf-8") != text:
            command.write_text(text, encoding="utf-8")
            command.chmod(0o755)
