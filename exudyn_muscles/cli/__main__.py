"""`python -m exudyn_muscles.cli`."""

import sys

from .main import main

sys.exit(main())
