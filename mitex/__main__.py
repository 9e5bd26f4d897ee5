"""`python -m mitex` is the `mitex` command."""

import sys

from mitex.cli import main

if __name__ == "__main__":
    sys.exit(main())
