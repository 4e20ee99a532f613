"""C99 files that stand for themselves: what they do, constants and functions, and a test vector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ._c99 import self_test

_TEXT = """\
/* {about}
 *
 * Written by robthermal. C99. Numbers are hexadecimal: exact. Sums run from the left.
 * Test: cc -std=c99 -ffp-contract=off -D{flag} this.c -lm && ./a.out prints the largest difference from the
 * vector at the end, relative to the largest value{exactly}. Exit status 1 above {tolerance:g}.
 */
#ifndef {p}_included
#define {p}_included

#include <math.h>
#include <stddef.h>

{body}
{main}
#endif
"""


@dataclass(frozen=True)
class Program:
    """A C99 file with a header guard, and a test behind a preprocessor flag.

    Parameters
    ----------
    prefix : str
        Prefix of every identifier.
    flag : str
        Macro that brings the test in.
    about : str
        Lines of the comment at the top: equations, units, how the functions are called.
    body : str
        Constants, types and functions.
    vector : sequence of sequence of float
        Rows of the test: inputs, followed by the outputs that must come out.
    n_in : int
        Number of inputs in a row of the test.
    setup, call : str
        C lines of the test before the loop over the rows, and inside it: they fill `out` from `in`, row `t`.
    columns : sequence of str, optional
        What every column of a row is, inputs first.
    tolerance : float
        Largest relative difference at which the test passes; 1e-9 for sums that are repeated digit by digit.

    Examples
    --------
    >>> twice = Program("twice", "TWICE_TEST", "Doubles a number.", "static double twice(double x) { return 2.0 * x; }",
    ...                 [[1.0, 2.0], [3.0, 6.0]], 1, "", "        out[0] = twice(in[0]);")
    >>> "#ifndef twice_included" in twice.text(), "#ifdef TWICE_TEST" in twice.text()
    (True, True)
    """

    prefix: str
    flag: str
    about: str
    body: str
    vector: Sequence[Sequence[float]]
    n_in: int
    setup: str
    call: str
    columns: Sequence[str] = ()
    tolerance: float = 1e-9

    def text(self) -> str:
        """Source of the file.

        Returns
        -------
        str
        """
        about = "\n".join(f" * {line}".rstrip() for line in self.about.splitlines()).removeprefix(" * ")
        main = self_test(self.prefix, self.flag, self.vector, self.n_in, self.setup, self.call,
                         self.tolerance)
        exactly = ": 0 without fused multiply-add" if self.tolerance <= 1e-9 else ""
        return _TEXT.format(about=about, p=self.prefix, flag=self.flag, body=self.body, main=main, exactly=exactly,
                            tolerance=self.tolerance)
