"""Messages that fit on a screen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ...errors import InputError

_LONGEST = 600  # characters of a message


@contextmanager
def short_errors() -> Iterator[None]:
    """Within, messages of input errors are at most 600 characters long."""
    try:
        yield
    except InputError as error:
        raise shortened(error) from None


def shortened(error: InputError) -> InputError:
    """The same error, at most 600 characters long."""
    over = len(str(error)) - _LONGEST
    if over <= 0:
        return error
    what = error.what if len(error.what) < over + 80 else error.what[: -over - 2] + " …"
    cut = InputError(what, where=error.where, expected=error.expected, remedy=error.remedy)
    over = len(str(cut)) - _LONGEST
    return (
        cut
        if over <= 0
        else InputError(
            what,
            where=error.where,
            expected=error.expected,
            remedy=cut.remedy[: max(20, len(cut.remedy) - over - 2)] + " …",
        )
    )
