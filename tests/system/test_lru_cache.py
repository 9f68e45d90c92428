"""A value is made once, whatever it is."""

from __future__ import annotations

from ccwsim.system.lru_cache import LruCache


def test_none_is_a_value_that_is_made_once():
    cache, made = LruCache[None](), []
    for _ in range(3):
        assert cache.get_or_make("no trend", lambda: made.append(1)) is None
    assert made == [1]


def test_the_least_recent_value_is_dropped():
    cache = LruCache[str](max_values=2)
    for key in "abc":
        cache.put(key, key.upper())
    assert (cache.get("a"), cache.get("c")) == (None, "C")
