"""Tests of this folder may import its own simulation, which does not go through the package."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
