"""`python -m freeswing`: the same as the command."""

import sys

from freeswing.main import main

if __name__ == "__main__":
    sys.exit(main())
