"""Decorators that compile functions to kernels or to parts of kernels.

Compiled kernels are stored on disk (see `kernel_cache`). Other processes compile missing kernels in
parallel (see `compilation`).
"""

import logging
import os
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, ClassVar

from numba import config, njit

from ccwsim.engine import numba_hooks
from ccwsim.engine.compilation import MissingKernelError, compile_missing, is_walking
from ccwsim.engine.kernel_cache import FOLDER

_log = logging.getLogger(__name__)


class Kernel:
    """A compiled function that Python calls, made by `kernel` or `allocating_kernel`."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        self.dispatcher = _compiled(function, FOLDER, **options)
        self.__doc__, self.__name__ = function.__doc__, function.__name__
        self.__module__, self.__wrapped__ = function.__module__, function
        self._allocates = "_nrt" not in options
        if FOLDER and numba_hooks.are_known() and hasattr(self.dispatcher, "_cache"):
            numba_hooks.ask_first(self.dispatcher, partial(compile_missing, self))

    def __call__(self, *values: Any, **named: Any) -> Any:
        try:
            return self.dispatcher(*values, **named)
        except MissingKernelError:
            return self.__wrapped__(*values, **named) if self._allocates else 0

    @property
    def n_functions(self) -> int:
        """Number of functions that are compiled into the kernel, including the kernel itself."""
        return len(_functions_in(self.__wrapped__, set()))


def _functions_in(function: Callable[..., Any], seen: set[Any]) -> set[Any]:
    """Return a function and all parts of kernels that the function calls directly or indirectly."""
    seen.add(function)
    for name in function.__code__.co_names:
        part = function.__globals__.get(name)
        if isinstance(part, part_of_kernel) and part.__wrapped__ not in seen:
            _functions_in(part.__wrapped__, seen)
    return seen


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function to run without the interpreter lock; the code is stored on disk.

    The function and its parts must not allocate arrays. Without reference counting of arrays
    (`_nrt=False`), a patch takes a third less time. Slices and `reshape` are allowed; `ravel` is
    not. Results are written to arrays in place; the return value is at most a count.
    """
    return Kernel(function, _nrt=False)


def allocating_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function like `kernel`, but allow the function to allocate arrays."""
    return Kernel(function)


class part_of_kernel:  # noqa: N801 - a decorator
    """A decorator for a function that is compiled into the kernels that call the function.

    Without a wrapper for calls from Python, compiling takes half the time. Compiling takes a
    quarter of the time if the function is optimized only in kernels. A call from Python, for
    example in a test, compiles the function separately.
    """

    options: ClassVar[dict[str, Any]] = {}

    def __init__(self, function: Callable[..., Any]) -> None:
        options = {"no_cpython_wrapper": True, **self.options}
        if numba_hooks.are_known():
            options["pipeline_class"] = numba_hooks.LinkedCompiler
        self._part = _compiled(function, "" if numba_hooks.are_known() else FOLDER, **options)
        if numba_hooks.are_known() and hasattr(self._part, "get_call_template"):
            numba_hooks.type_without_literals(self._part)
        self.__doc__, self.__name__ = function.__doc__, function.__name__
        self.__wrapped__ = function
        self._alone: Any = None

    @property
    def _numba_type_(self) -> Any:
        return self._part._numba_type_

    def __call__(self, *values: Any, **named: Any) -> Any:
        if is_walking():
            return self.__wrapped__(*values, **named)
        if self._alone is None:  # separate folder: a cache confuses both versions
            self._alone = _compiled(self.__wrapped__, FOLDER and os.path.join(FOLDER, "alone"))
        return self._alone(*values, **named)


class inlined_part_of_kernel(part_of_kernel):  # noqa: N801 - a decorator
    """Like `part_of_kernel`, but each call is replaced by the code of the function (inlining).

    Use this decorator for the most frequently called functions, because passing a few arrays takes
    longer than comparing a hundred cells.
    """

    options: ClassVar[dict[str, Any]] = {"inline": "always"}

    @property
    def targetoptions(self) -> dict[str, Any]:
        """Options of the function, which tell Numba to inline calls."""
        return self._part.targetoptions

    @property
    def py_func(self) -> Callable[..., Any]:
        """The Python function that Numba inlines."""
        return self.__wrapped__


def _compiled(function: Callable[..., Any], folder: str, **options: Any) -> Any:
    """Return Numba's compiled function; the code is stored in `folder` unless `folder` is ""."""
    options |= {"no_cfunc_wrapper": True, "error_model": "numpy"}
    if not folder or numba_hooks.are_known():
        dispatcher = njit(nogil=True, **options)(function)
        if folder and hasattr(dispatcher, "_cache"):  # absent if NUMBA_DISABLE_JIT is set
            numba_hooks.keep_in(folder, dispatcher)
        return _with_robust_cache(dispatcher)
    folder_of_others = getattr(config, "CACHE_DIR")  # noqa: B009 - defined at run time, unknown to type checkers
    # Numba reads CACHE_DIR when a function is decorated; it is reset later for other packages.
    setattr(config, "CACHE_DIR", folder)  # noqa: B010
    try:
        return _with_robust_cache(njit(nogil=True, cache=True, **options)(function))
    finally:
        setattr(config, "CACHE_DIR", folder_of_others)  # noqa: B010


def _with_robust_cache(dispatcher: Any) -> Any:
    """Make a kernel recompile if its files are damaged; otherwise Numba would fail every time."""
    cache = getattr(dispatcher, "_cache", None)  # absent if NUMBA_DISABLE_JIT is set
    if cache is None:
        return dispatcher
    load = cache.load_overload

    def load_or_compile(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception as error:  # damaged pickles raise all kinds of errors
            name = dispatcher.py_func.__name__
            _log.warning("Kernel %s on disk is damaged (%r) and is recompiled.", name, error)
            with suppress(OSError):
                cache.flush()
            return None

    cache.load_overload = load_or_compile
    return dispatcher
