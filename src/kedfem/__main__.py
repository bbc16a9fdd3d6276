"""`python -m kedfem` is the command `kedfem`."""

from kedfem.cli import main

if __name__ == "__main__":
    main()
