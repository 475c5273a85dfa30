"""The command `tmcm34x`, also as `python -m tmcm34x`: ready for Ctrl-C before the command line is imported."""

from tmcm34x.interrupts import Leaving, keep_interrupts


def main() -> None:
    """Entry point of the command."""
    keep_interrupts()
    with Leaving():
        from tmcm34x.cli import main as command_line
    command_line()


if __name__ == "__main__":
    main()
