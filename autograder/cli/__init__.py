"""The command `autograder`."""


def main() -> None:
    """Run the command; what it needs is loaded then."""
    from autograder.cli.main import main as run

    run()
