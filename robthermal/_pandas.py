"""pandas, imported when a name of it is first used: `from .._pandas import pd` stands for `import pandas as pd`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._first_use import OnFirstUse

__all__ = ["pd"]

if TYPE_CHECKING:
    import pandas as pd
else:
    pd = OnFirstUse("pandas")
