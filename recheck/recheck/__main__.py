"""Command line: python -m recheck FILE…"""

from __future__ import annotations

import sys

from . import Unreadable, check

_USAGE = """usage: python -m recheck CERTIFICATE.json…

Checks robthermal certificates with a second, independent program.
Exit status: 0 every file is valid; 1 a file is not valid; 2 otherwise (not covered, or unreadable)."""


def main(arguments: list[str]) -> int:
    """Check the files and return the exit status."""
    if not arguments or {"-h", "--help"} & set(arguments):
        print(_USAGE, file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else 2
    statuses = []
    for name in arguments:
        try:
            found = check(name)
        except Unreadable as error:
            print(f"{ascii(name)}: unreadable: {error}", file=sys.stderr)
            statuses.append("unreadable")
            continue
        print(f"{ascii(name)}: {found}")
        if found:
            print(f"  {found.claim}")
        statuses.append(found.status)
    return 1 if "not valid" in statuses else 0 if all(status == "valid" for status in statuses) else 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
