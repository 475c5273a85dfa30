"""`python -m tmcm34x` is the command `tmcm34x`."""

from tmcm34x.cli import main

if __name__ == "__main__":
    main()
