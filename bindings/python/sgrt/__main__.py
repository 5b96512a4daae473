"""`python -m sgrt` is the command `sgrt`."""

import sys

from .cli import main

sys.exit(main())
