"""One function over many cases, on one machine or a cluster, with results kept as they come."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from .._joblib import joblib
from ..errors import InputError, Outcome
from ._batches import Batches, answer_batch
from ._outcomes import FleetCode
from ._store import Answer, Store, key_of

_SHOWN = 10  # errors on the screen


@dataclass(frozen=True)
class FleetRun:
    """Results of one function over many cases, in the order of the cases.

    Parameters
    ----------
    cases : tuple
        What the function was called with.
    done : mapping of int to Any
        Case number to result.
    errors : mapping of int to InputError
        Case number to what went wrong; other exceptions than `InputError` are told by name in its text.
    computed : int
        How many cases were computed this time; the others were found in the store.
    outcome : Outcome
        "done", or "failed" when some case has no result.
    """

    cases: tuple[Any, ...]
    done: Mapping[int, Any]
    errors: Mapping[int, InputError]
    computed: int
    outcome: Outcome

    @property
    def results(self) -> list[Any]:
        """Every result, in order; raises the first error if a case failed."""
        for error in self.errors.values():
            raise error
        return list(self.done.values())

    def __str__(self) -> str:
        return "\n".join([self.outcome.text, *(f"  {error}" for error in list(self.errors.values())[:_SHOWN])])


def fleet(function: Callable[[Any], Any], cases: Sequence[Any], *, store: str | Path | None = None, setting: str = "",
          jobs: int | None = None, progress: Callable[[int, int], None] = lambda done, total: None) -> FleetRun:
    """Run one function over many cases: on this machine's cores, or on whatever joblib backend is active.

    On a cluster nothing changes but two lines around the call:
    ``from joblib import parallel_config`` and ``with parallel_config(backend="dask"):``.

    Parameters
    ----------
    function : callable
        Called with one case. An `InputError`, or any other exception, is the result of that case: the others go on.
    cases : sequence
        With a store: of plain values (numbers, texts, lists, dictionaries with text keys), for example seeds,
        operating conditions or paths of records; the results too. A case that stands twice is computed once.
    store : str or path, optional
        File that gets one line of JSON per finished case. A run that was stopped continues where it was: what has a
        result or an `InputError` in the file is not computed again, any other exception is tried again. Short cases
        travel in batches of about half a second; what is stopped loses the batch that each process has in hand.
    setting : str
        What else the results depend on, for example ``rt.thermal.format_system(system)``. A store that was made with
        another function name or setting is refused.
    jobs : int, optional
        Processes; default what joblib's `parallel_config` says, else 1.
    progress : callable, optional
        Called with the number of cases done and how many there are, once for every case that is done.

    Returns
    -------
    FleetRun
        The same whatever the number of processes, the backend and the order in which cases finish.

    Raises
    ------
    InputError
        Cases or results that are no plain values, where there is a store; a store of other results.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> def slowest(conductance):  # time constant [s]
    ...     return float(-1 / system.with_parameters({"links.x1-x3.conductance": conductance}).poles()[0])
    >>> run = rt.fleet(slowest, [2.0, 4.0, 8.0], store="slowest.jsonl", setting=rt.thermal.format_system(system))
    >>> run.outcome.code, run.computed, run.results == sorted(run.results, reverse=True)
    ('done', 3, True)
    >>> rt.fleet(slowest, [2.0, 4.0, 8.0, 16.0], store="slowest.jsonl",
    ...          setting=rt.thermal.format_system(system)).computed  # a restart
    1
    """
    total = len(cases)
    if jobs is not None and (not isinstance(jobs, int) or isinstance(jobs, bool) or jobs == 0):
        raise InputError(f"jobs = {jobs!r}", where="argument jobs", expected="a whole number, at least 1")
    book = None if store is None else Store(store, f"{_name(function)} {key_of(setting)}")
    keys = [i if book is None else key_of(case) for i, case in enumerate(cases)]
    answers: dict[Any, Answer] = {} if book is None else book.read()
    todo = {key: case for key, case in zip(keys, cases, strict=True) if key not in answers}
    copies = Counter(keys)
    finished = sum(copies[key] for key in copies if key in answers)
    progress(finished, total)
    computed = len(todo)
    batches = Batches(todo, joblib.effective_n_jobs(jobs))
    while batches:  # a second time only if a worker gave back cases after the last batch was handed out
        work = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)(
            joblib.delayed(answer_batch)(function, number, [todo[key] for key in batch]) for number, batch in batches)
        for done in map(batches.back, work):
            for key, answer in done if book is None else book.add(done):
                answers[key] = answer
                del todo[key]
                finished += copies[key]
                progress(finished, total)
    return _run(tuple(cases), [answers[key] for key in keys], computed)


def _run(cases: tuple[Any, ...], answers: list[Answer], computed: int) -> FleetRun:
    errors = {i: _error(i, answer.error) for i, answer in enumerate(answers) if answer.error}
    done = {i: answer.result for i, answer in enumerate(answers) if i not in errors}
    outcome = FleetCode.DONE.outcome(f"{len(cases)} cases done.") if not errors else FleetCode.FAILED.outcome(
        f"{len(errors)} of {len(cases)} cases failed. The first: {errors[min(errors)]}", remedy="")
    return FleetRun(cases, done, errors, computed, outcome)


def _error(case: int, parts: Mapping[str, str]) -> InputError:
    where = f"case {case}" + (f", {parts['where']}" if parts.get("where") else "")
    return InputError(parts["what"], where=where, expected=parts.get("expected", ""), remedy=parts.get("remedy", ""))


def _name(function: Callable[[Any], Any]) -> str:
    """What a function is called, also behind functools.partial."""
    inner = function.func if isinstance(function, partial) else function
    return f"{getattr(inner, '__module__', '')}.{getattr(inner, '__qualname__', type(inner).__qualname__)}"
