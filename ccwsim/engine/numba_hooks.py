"""Hooks into private parts of Numba that speed up compiling; no other file uses private parts.

They are used only with the minor version of Numba they were tested with. With other versions
kernels are compiled in Numba's usual way, which is slower but gives the same code.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from hashlib import blake2b
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numba
from numba import types
from numba.core import caching, codegen, compiler

TESTED = "0.68"
"""Minor version of Numba whose private parts are known."""


def are_known(version: str = numba.__version__) -> bool:
    """Return whether the private parts of a version of Numba were tested."""
    return version.split(".")[:2] == TESTED.split(".")


class _LinkedLibrary(codegen.JITCodeLibrary):
    """The unoptimized code of a part of kernels, which is optimized only in the kernels.

    Otherwise Numba would optimize and translate each part once separately and again in each kernel.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, because the code of a part has no address."""
        return 0

    @property
    def codegen(self) -> Any:
        """A stand-in without effect, because parts never use Numba's Python environment."""
        return SimpleNamespace(set_env=lambda name, environment: None)


class LinkedCompiler(compiler.CompilerBase):
    """A `pipeline_class` that compiles a part without the steps that kernels do not need."""

    def define_pipelines(self) -> list[Any]:
        """Return the usual passes of Numba, for a library that is only linked."""
        state = self.state
        state.library = _LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return [compiler.DefaultPassBuilder.define_nopython_pipeline(state)]


def type_without_literals(dispatcher: Any) -> None:
    """Compile a part once for all integers, not again for each constant argument.

    LLVM still uses the constant if it inlines the part.
    """
    template_of = dispatcher.get_call_template

    def get_call_template(values: Any, named: Any) -> Any:
        plain = {name: types.unliteral(kind) for name, kind in named.items()}
        return template_of(tuple(types.unliteral(kind) for kind in values), plain)

    dispatcher.get_call_template = get_call_template


class _Locator(caching._CacheLocator):
    """The location of a kernel. It depends on the content of all kernels, not on path and date."""

    def __init__(self, function: Callable[..., Any], folder: str) -> None:
        self._path = os.path.join(folder, function.__module__)
        self._stamp = os.path.basename(folder)
        self._py_file, self._line = function.__code__.co_filename, function.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return self._path

    def get_source_stamp(self) -> str:
        return self._stamp

    def get_disambiguator(self) -> str:
        return str(self._line)


class _Files:
    """The files of one function, two for each signature, so that processes can write at once.

    Numba itself has one index for all signatures. If two processes changed this index at the same
    time, a process could load code of the wrong signature.
    """

    def __init__(self, path: str, base: str, stamp: str) -> None:
        self._path, self._base, self._stamp = path, base, stamp

    def _pair(self, key: Any) -> caching.IndexDataCacheFile:
        name = blake2b(repr(key).encode(), digest_size=6).hexdigest()
        return caching.IndexDataCacheFile(self._path, f"{self._base}.{name}", self._stamp)

    def save(self, key: Any, data: Any) -> None:
        self._pair(key).save(key, data)

    def load(self, key: Any) -> Any:
        return self._pair(key).load(key)

    def has(self, key: Any) -> bool:
        """Return whether code for a key is on disk; it may still be damaged."""
        pair = self._pair(key)
        try:
            name = pair._load_index().get(key)
        except Exception:  # damaged pickles raise all kinds of errors
            return False
        return name is not None and os.path.exists(pair._data_path(name))

    def flush(self) -> None:
        """Forget all signatures."""
        for file in Path(self._path).glob(f"{self._base}.*.nbi"):
            file.unlink(missing_ok=True)


class _Cache(caching.FunctionCache):
    """Numba's cache of one function, in our own folder and files."""

    _cache_file: Any

    def __init__(self, function: Callable[..., Any], folder: str) -> None:
        locator = _Locator(function, folder)

        class Impl(caching.CompileResultCacheImpl):
            _locator_classes: ClassVar = [SimpleNamespace(from_function=lambda *_: locator)]

        self._impl_class = Impl
        super().__init__(function)
        base = self._impl.filename_base
        self._cache_file = _Files(self._cache_path, base, locator.get_source_stamp())

    def has(self, signature: Any, target: Any) -> bool:
        """Return whether the code for a signature is on disk."""
        return self._cache_file.has(self._index_key(signature, target.codegen()))


def keep_in(folder: str, dispatcher: Any) -> None:
    """Keep the compiled code of a function in a folder named after the content of all kernels.

    The code is then also found after a checkout was moved or copied, from a second environment and
    in the layers of a container image. Numba adds the processor and the Python version to its key.
    """
    dispatcher._cache = _Cache(dispatcher.py_func, folder)


def is_on_disk(dispatcher: Any, signature: Any) -> bool:
    """Return whether the code for a signature is on disk, or loaded."""
    return signature in dispatcher.overloads or dispatcher._cache.has(
        signature, dispatcher.targetctx
    )


def ask_first(dispatcher: Any, ask: Callable[[tuple[Any, ...]], None]) -> None:
    """Call `ask(signature)` before a call compiles code that is not on disk.

    Code that is on disk afterwards is loaded; if `ask` raises, so does the call.
    """
    compile_here = dispatcher.compile

    def compile_or_load(signature: Any) -> Any:
        if isinstance(signature, tuple) and not is_on_disk(dispatcher, signature):
            ask(signature)
        return compile_here(signature)

    dispatcher.compile = compile_or_load
