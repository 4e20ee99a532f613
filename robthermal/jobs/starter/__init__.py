"""Projects to start from: the demo, and a commented one with simulated records."""

from ._demo import demo_project as demo_project
from ._starter import new_project as new_project

__all__ = ["demo_project", "new_project"]
