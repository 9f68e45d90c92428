"""Hooks into the private interface of Numba that speed up compiling.

Only this file uses the private interface, and only with the tested minor version of Numba. With
other versions, Numba compiles kernels in the usual way, which is slower but gives the same results.
"""

import os
from collections.abc import Callable
from hashlib import blake2b
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numba
from numba import types
from numba.core import boxing, caching, cgutils, codegen, compiler, pythonapi

DIGEST_SIZE = 16  # number of bytes of the digest at the end of a file of compiled code
TESTED = "0.68"  # minor version of Numba with which the hooks were tested


def are_known(version: str = numba.__version__) -> bool:
    """Return whether the hooks were tested with the given version of Numba."""
    return version.split(".")[:2] == TESTED.split(".")


def _unbox_generator(kind: Any, generator: Any, c: Any) -> pythonapi.NativeValue:
    """Convert a random generator, which the caller of a kernel holds until the kernel returns.

    Numba adds a reference to the generator and removes this reference only in functions with
    reference counting, so that each call of another kernel would keep its generator in memory.
    """
    if c.context.enable_nrt:
        return boxing.unbox_numpy_random_generator(kind, generator, c)
    bits = c.pyapi.object_getattr_string(generator, "bit_generator")
    unboxed = c.unbox(boxing._bit_gen_type, bits)
    c.pyapi.decref(bits)
    native = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    native.bit_generator, native.parent = unboxed.value, generator
    return pythonapi.NativeValue(native._getvalue(), is_error=unboxed.is_error)


if are_known():
    pythonapi._unboxers.functions[types.NumPyRandomGeneratorType] = _unbox_generator


class _LinkedLibrary(codegen.JITCodeLibrary):
    """The unoptimized code of a part of kernels, for linking into kernels.

    The code is optimized only in kernels; Numba would otherwise also optimize it separately.
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
        """A substitute whose `set_env` does nothing; parts never use a Python environment."""
        return SimpleNamespace(set_env=lambda name, environment: None)


class LinkedCompiler(compiler.CompilerBase):
    """A `pipeline_class` that compiles a part without the steps that kernels do not need."""

    def define_pipelines(self) -> list[Any]:
        """Return the usual compiler passes of Numba, applied to a `_LinkedLibrary`."""
        state = self.state
        state.library = _LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return [compiler.DefaultPassBuilder.define_nopython_pipeline(state)]


def type_without_literals(dispatcher: Any) -> None:
    """Compile a part of kernels once per integer type, not once per constant argument.

    If LLVM inlines the part, LLVM still uses the constant.
    """
    template_of = dispatcher.get_call_template

    def get_call_template(values: Any, named: Any) -> Any:
        plain = {name: types.unliteral(kind) for name, kind in named.items()}
        return template_of(tuple(types.unliteral(kind) for kind in values), plain)

    dispatcher.get_call_template = get_call_template


class _Locator(caching._CacheLocator):
    """The cache location of a kernel: a folder named after the content of all kernels."""

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


class _Pair(caching.IndexDataCacheFile):
    """The two files of one signature: an index, and the code, which ends with its digest."""

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(content + _digest(content))

    def _load_data(self, name: str) -> Any:
        path = Path(self._data_path(name))
        if path.exists() and not is_whole(path):
            raise ValueError(f"{path.name} is incomplete")
        return super()._load_data(name)


def is_whole(path: Path) -> bool:
    """Return whether a file of compiled code is complete and unchanged.

    With untested versions of Numba, the file counts as complete, because this is unknown.
    """
    try:
        content = path.read_bytes()
    except OSError:
        return False
    return not are_known() or content[-DIGEST_SIZE:] == _digest(content[:-DIGEST_SIZE])


def _digest(content: bytes) -> bytes:
    return blake2b(content, digest_size=DIGEST_SIZE).digest()


class _Files:
    """The cache files of one function: two files for each signature.

    Numba's default is one index file for all signatures. If two processes changed this index at the
    same time, a process could load code for a wrong signature.
    """

    def __init__(self, path: str, base: str, stamp: str) -> None:
        self._path, self._base, self._stamp = path, base, stamp

    def _pair(self, key: Any) -> _Pair:
        name = blake2b(repr(key).encode(), digest_size=6).hexdigest()
        return _Pair(self._path, f"{self._base}.{name}", self._stamp)

    def save(self, key: Any, data: Any) -> None:
        self._pair(key).save(key, data)

    def load(self, key: Any) -> Any:
        return self._pair(key).load(key)

    def has(self, key: Any) -> bool:
        """Return whether the disk has the complete code for a key."""
        pair = self._pair(key)
        try:
            name = pair._load_index().get(key)
        except Exception:  # damaged pickles raise all kinds of errors
            return False
        return name is not None and is_whole(Path(pair._data_path(name)))

    def flush(self) -> None:
        """Delete the index files of all signatures."""
        for file in Path(self._path).glob(f"{self._base}.*.nbi"):
            file.unlink(missing_ok=True)


class _Cache(caching.FunctionCache):
    """Numba's cache of one function, with the folder of `_Locator` and the files of `_Files`."""

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
    """Store the compiled code of a function in a folder named after the content of all kernels.

    The code remains valid if the checkout is moved or copied, for example into a container image.
    Numba adds the processor and the Python version to the key.
    """
    dispatcher._cache = _Cache(dispatcher.py_func, folder)


def is_on_disk(dispatcher: Any, signature: Any) -> bool:
    """Return whether the code for a signature is loaded or on disk."""
    return signature in dispatcher.overloads or dispatcher._cache.has(
        signature, dispatcher.targetctx
    )


def ask_first(dispatcher: Any, ask: Callable[[tuple[Any, ...]], None]) -> None:
    """Patch `dispatcher` to call `ask(signature)` before compiling code that is not on disk.

    Code that `ask` writes to disk is loaded. If `ask` raises an error, the kernel is not run.
    """
    compile_here = dispatcher.compile

    def compile_or_load(signature: Any) -> Any:
        if isinstance(signature, tuple) and not is_on_disk(dispatcher, signature):
            ask(signature)
        return compile_here(signature)

    dispatcher.compile = compile_or_load
