"""Reading in a process beside this one, which can be ended: neither a regular expression nor a parser can be stopped.

The process starts with the first reading that needs it and serves all others of its worker; it ends with it.
"""

import pickle
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from stemcal.child import Child, ChildDied, ChildLate
from stemcal.solvers.programs.reductions import NoResult

P = ParamSpec("P")
T = TypeVar("T")

LEAST_READING_S = 2.0  # also after a program that took all of its time

_lock = threading.Lock()
_idle: list[Child] = []


def run_in_helper(seconds: float, function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> T:
    """Return what a function of a module gives, called in the process beside this one.

    Raises
    ------
    NoResult
        ``timeout`` if it takes longer than so many seconds, ``bad_result`` if it raises or the process died of it.
    """
    with _lock:
        child = _living()
        answer: T
        try:
            answer, error = child.call(pickle.dumps((function, args, kwargs)), seconds)
        except ChildLate:
            child.kill()
            raise NoResult(
                "timeout", "reading the result took longer than what was left of solver.time_limit"
            ) from None
        except ChildDied as died:
            child.kill()
            raise NoResult("bad_result", f"the process that read the result ended: {died}") from None
        except BaseException:  # an interrupt: the next call must not get this one's answer
            child.kill()
            raise
        _idle.append(child)
    if error is not None:
        raise _no_result(error)
    return answer


def _living() -> Child:
    """Return the process that waits for calls; a new one if there is none, or it was ended meanwhile."""
    child = _idle.pop() if _idle else None
    return child if child is not None and child.is_alive else Child()


def _no_result(error: BaseException) -> NoResult:
    """Return what a reading raised as the reason why there is no result."""
    if isinstance(error, NoResult):
        return error
    if isinstance(error, MemoryError):
        return NoResult("bad_result", "there is not enough memory to read the result")
    return NoResult("bad_result", f"{type(error).__name__}: {error}")
