"""Pieces of C99 text: exact numbers, tables, names, and the program that checks a test vector."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

_MAIN = """\
#ifdef {flag}
#include <stdio.h>

/* In every row: inputs, then what must come out. */
static const double {p}_test[{n}][{width}] = {{
{rows}
}};

int main(void)
{{
    double largest[{n_out}] = {{0}}, wrong[{n_out}] = {{0}}, worst = 0.0;
{setup}
    for (int t = 0; t < {n}; t++) {{
        const double *in = {p}_test[t], *right = in + {n_in};
        double out[{n_out}];
{call}
        for (int k = 0; k < {n_out}; k++) {{
            double off = fabs(out[k] - right[k]);
            largest[k] = fmax(largest[k], fabs(right[k]));
            wrong[k] = off <= wrong[k] ? wrong[k] : off; /* NaN counts as wrong */
        }}
    }}
    for (int k = 0; k < {n_out}; k++) {{
        double ratio = wrong[k] == 0.0 ? 0.0 : wrong[k] / largest[k];
        worst = ratio <= worst ? worst : ratio;
    }}
    printf("%.3g\\n", worst);
    return worst <= {tolerance:g} ? 0 : 1;
}}
#endif"""


def number(value: float) -> str:
    """A double, exactly: hexadecimal, or INFINITY of math.h.

    Parameters
    ----------
    value : float
        Number to write, not NaN.
    """
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return float(value).hex()


def doubles(values: Iterable[float]) -> str:
    """Initializer of an array of doubles.

    Parameters
    ----------
    values : iterable of float
        Entries of the array.
    """
    return "{" + ", ".join(number(value) for value in values) + "}"


def rows(table: Iterable[Sequence[float]]) -> str:
    """Initializer of a two-dimensional array, a row per line, without the outer braces.

    Parameters
    ----------
    table : iterable of sequence of float
        Rows of the table.
    """
    return ",\n".join("    " + doubles(row) for row in table)


def identifier(name: str, otherwise: str) -> str:
    """A name that C allows: other characters become underscores.

    Parameters
    ----------
    name : str
        What the user calls it.
    otherwise : str
        What to put before a name that does not start with a letter.
    """
    word = re.sub(r"[^0-9A-Za-z_]", "_", name)
    return word if word[:1].isalpha() else f"{otherwise}_{word}" if word else otherwise


def comment(text: str) -> str:
    """Text for the inside of a C comment.

    Parameters
    ----------
    text : str
        A line of it.
    """
    return re.sub(r"[^ -~]", "_", text).replace("*/", "* /").replace("??", "_?")  # ?? would start a trigraph


def self_test(prefix: str, flag: str, table: Sequence[Sequence[float]], n_in: int, setup: str, call: str,
              tolerance: float) -> str:
    """Text of a program that runs a test vector, behind a preprocessor flag.

    It prints the largest difference relative to the largest value of the same output, 0 without fused multiply-add,
    and ends with status 1 above the tolerance.

    Parameters
    ----------
    prefix : str
        Of every identifier.
    flag : str
        Macro that brings the program in.
    table : sequence of sequence of float
        Rows of inputs, followed by outputs.
    n_in : int
        Number of inputs in a row.
    setup, call : str
        C lines before the loop, and inside it: they fill `out` from `in`, row `t`.
    tolerance : float
        Largest relative difference that passes.
    """
    width = len(table[0])
    return _MAIN.format(p=prefix, flag=flag, rows=rows(table), n=len(table), width=width, n_in=n_in,
                        n_out=width - n_in, setup=setup, call=call, tolerance=tolerance)
