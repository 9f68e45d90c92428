"""Test that the time to draw a page does not grow with the length of its address."""

from __future__ import annotations

import pytest
from streamlit.runtime.state.query_params_proxy import QueryParamsProxy
from streamlit.testing.v1 import AppTest

from ccwsim.model.bounds import MAX_LINK_LETTERS, MAX_LINK_VALUES
from ccwsim.sharing import link
from ccwsim.ui.session import address


def script() -> None:
    """Update the address of a study that does not change."""
    from ccwsim.ui.session.address import follow_study
    from ccwsim.ui.session.state import State

    follow_study(State())


LONG = {
    "names": {f"templte{k}": "1" for k in range(5000)},
    "names of others": {f"utm_{k}": "1" for k in range(5000)},
    "values": {"colour": ["red"] * 5000, "utm_source": "mail"},
    "letters of values": {f"utm_{k}": "x" * 1000 for k in range(150)},
    "letters of names": {str(k) * 1000: "1" for k in range(150)},
}


@pytest.mark.parametrize("query", LONG.values(), ids=list(LONG))
def test_of_a_long_address_a_run_looks_at_its_beginning(query, monkeypatch):
    counts = dict.fromkeys(("read", "compared", "written"), 0)
    read, compare, write = QueryParamsProxy.get_all, link.get_close_matches, address.urlencode

    def get_all(self, name):
        counts["read"] += 1
        return read(self, name)

    def closest(name, *args, **options):
        counts["compared"] += 1
        return compare(name, *args, **options)

    def encoded(wanted, doseq):
        text = write(wanted, doseq=doseq)
        counts["written"] = max(counts["written"], len(text))
        return text

    monkeypatch.setattr(QueryParamsProxy, "get_all", get_all)
    monkeypatch.setattr(link, "get_close_matches", closest)
    monkeypatch.setattr(address, "urlencode", encoded)
    link._closest.cache_clear()
    for runs in (1, 2):  # the browser may still have its previous address
        app = AppTest.from_function(script)
        for name, value in query.items():
            app.query_params[name] = value
        app.run()
        assert not app.exception
        assert counts["read"] <= runs * (MAX_LINK_VALUES + 1)
        assert counts["compared"] <= MAX_LINK_VALUES
        assert counts["written"] <= MAX_LINK_LETTERS + 2 * MAX_LINK_VALUES
