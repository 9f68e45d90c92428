"""A cache of results that all sessions share, with the contents of arguments as keys."""

from collections.abc import Callable
from functools import partial, wraps
from types import FunctionType
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import streamlit as st

from ccwsim import Ensemble, Grid, HardData, Parameters, Secondary, TrainingImage
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.statistics import Task
from ccwsim.model import Fraction, digest
from ccwsim.sharing.choices import DataChoice, GuideChoice, ImageChoice, Upload, WellTables

MAX_CACHED, MAX_CACHED_BYTES = 96, 256 * 10**6
# number of values that stay cached even if they are large; a page shows fewer values
MIN_CACHED = 24
Key = TypeVar("Key")
Value = TypeVar("Value")
Given = ParamSpec("Given")


def kept_with(read: Callable[[Key], Value]) -> Callable[[Key], Value]:
    """Return `read` with a cache that needs no digests; a value is kept as long as its argument."""
    values: WeakKeyDictionary[Key, Value] = WeakKeyDictionary()

    @wraps(read)
    def cached_read(owner: Key) -> Value:
        if (value := values.get(owner)) is None:
            value = values[owner] = read(owner)
        return value

    return cached_read


@kept_with
def _of_ensemble(e: Ensemble) -> str:
    return digest(e.digest, *e.study.key(), e.sources is None)


CONTENT: dict[str | type[Any], Callable[[Any], Any]] = {
    Upload: lambda upload: upload.digest,
    ImageChoice: lambda choice: choice.digest,
    DataChoice: lambda choice: [choice.upload, choice.tables, choice.answers],
    GuideChoice: lambda choice: choice.digest,
    WellTables: vars,
    TrainingImage: lambda image: repr((image.digest, image.facies_names, image.numbering)),
    Grid: repr,
    HardData: lambda data: data.digest,
    Parameters: lambda parameters: parameters.digest,
    Secondary: lambda secondary: secondary.digest,
    Ensemble: _of_ensemble,
    FunctionType: lambda function: (function.__module__, function.__qualname__),
}
"""Functions that return the content of an argument, by type of the argument."""
cached = partial(st.cache_resource, show_spinner=False, hash_funcs=CONTENT)


def as_task(
    work: Callable[Concatenate[Fraction, Given], Value], name: str = ""
) -> Callable[Given, Task[Value]]:
    """Return a function that makes a task; its arguments, and a name, are the task's key."""

    @wraps(work)
    def task_of(*arguments: Given.args, **options: Given.kwargs) -> Task[Value]:
        values = *arguments, *options.values()
        key = name or work.__name__, *(CONTENT.get(type(value), repr)(value) for value in values)
        return Task(key, lambda progress: work(progress, *arguments, **options))

    return task_of


@st.cache_resource(show_spinner=False)
def shared_values() -> Memo:
    """Return the cache of values that all sessions share; the keys are digests of contents."""
    return Memo(MAX_CACHED, MAX_CACHED_BYTES, MIN_CACHED)
