"""`python -m somatopy` is the command line."""

import sys

from somatopy.cli import main

if __name__ == "__main__":
    sys.exit(main())
