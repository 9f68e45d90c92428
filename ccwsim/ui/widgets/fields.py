"""Widgets that show a value of the state and write the user's changes to the state."""

from collections.abc import Callable, Mapping
from mimetypes import guess_type
from typing import Any, NamedTuple

import streamlit as st

from ccwsim.model import parameter_table
from ccwsim.ui.widgets.errors import catch_callback_errors, tells_errors

MAX_VERSIONS = 16
PARAMETER_ROWS = {row["name"]: row for row in parameter_table()}


def button(
    label: str, *, on_click: Callable[..., Any], key: str | None = None, **options: Any
) -> bool:
    """Draw a button; errors in `on_click` are shown when the page is drawn again."""
    return st.button(label, key=key, on_click=catch_callback_errors(on_click), **options)


def menu(label: str, key: str, draw: Callable[[], object], **options: Any) -> None:
    """Draw a menu; its content is drawn by `draw`, only while the menu is open."""
    with st.popover(label, key=key, on_change="rerun", **options) as place:
        if place.open:
            draw()


def download(
    label: str, content: bytes | Callable[[], bytes], name: str, *, key: str, **options: Any
) -> None:
    """Draw a download button; a function `content` is called when the button is pressed.

    The page shows why a file cannot be created.
    """
    mime = guess_type(name)[0] or "application/octet-stream"
    content = content if isinstance(content, bytes) else tells_errors(content)
    st.download_button(
        label, content, file_name=name, mime=mime, key=key, on_click="ignore", **options
    )


class Download(NamedTuple):
    """A file to download, which is created when the user chooses it."""

    label: str
    key: str
    ending: str  # end of the file name, after the name of the study
    content: Callable[[], bytes]

    def draw(self, name: str) -> None:
        """Draw a button that downloads the file; `name` is the name of the study."""
        download(self.label, self.content, f"{name}{self.ending}", key=f"download_{self.key}")


def field(
    widget: Callable[..., Any],
    label: str,
    *,
    key: str,
    value: Any,
    write: Callable[[Any], None],
    **options: Any,
) -> Any:
    """Draw a widget with a value of the state; `write` is called with changes before the redraw."""
    version = _version(key, value, labels_of(options))
    name = key + " " * version

    def changed() -> None:
        new, (now, *start, latest) = st.session_state[name], _versions()[key]
        chosen = new if isinstance(new, list) else [new]
        offered = chosen if options.get("accept_new_options") else options.get("options", chosen)
        # a browser may send a value that the page has set, as if the user had chosen it
        is_new = now == version and new not in (None, latest)
        if is_new and all(option in offered for option in chosen):
            _versions()[key] = now, *start, new
            write(new)

    options = starting_at(widget, value, within(value, options))
    return widget(label, key=name, on_change=catch_callback_errors(changed), **options)


def labels_of(options: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the labels of a widget's options; empty if the options have no separate labels."""
    label_of = options.get("format_func")
    return tuple(label_of(option) for option in options.get("options", ())) if label_of else ()


def _version(key: str, value: Any, labels: tuple[str, ...]) -> int:
    """Return a version number that changes when the state's value differs from the widget's.

    After a new value is set, a widget sends the old value until the browser has redrawn the widget.
    The old value looks like a change by the user. So a new widget replaces the old widget, and
    stale browser values are dropped. The version also changes when labels change. Keys of new
    versions end in more spaces, so their CSS class is the same.
    """
    version, start, called, _ = _versions().get(key, (0, value, labels, value))
    if called != labels or st.session_state.get(key + " " * version, start) != value:
        version, start = (version + 1) % MAX_VERSIONS, value
    _versions()[key] = version, start, labels, value
    return version


def _versions() -> dict[str, tuple[Any, ...]]:
    """Return the version, first value, labels and latest value of each widget of the session."""
    return st.session_state.setdefault("field_versions", {})


def within(value: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Return the options of a widget, with bounds that include the value of the study."""
    bounds = {"min_value": min, "max_value": max}
    present = [name for name in bounds if options.get(name) is not None and value is not None]
    return options | {name: bounds[name](options[name], value) for name in present}


def starting_at(widget: Callable[..., Any], value: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Return options that include the initial value, under the name that the widget uses for it."""
    kind = getattr(widget, "__name__", "")
    if kind in ("selectbox", "radio"):
        choices = list(options["options"])
        return options | {"index": choices.index(value) if value in choices else None}
    return options | {"default" if kind in ("segmented_control", "pills") else "value": value}


def help_of(name: str) -> str:
    """Return the help text of a parameter: meaning, allowed values and other names."""
    row = PARAMETER_ROWS[name]
    symbols = [f"{row['symbol']} in the paper"] if row["symbol"] else []
    symbols += [f"`{row['matlab']}` in the authors' code"] if row["matlab"] else []
    tail = f" Also: {', '.join(symbols)}." if symbols else ""
    return f"{row['meaning']} Allowed: {row['allowed']}.{tail}"


def bound_to(
    owner: object, name: str, change: Callable[..., object] | None = None, **options: Any
) -> dict[str, Any]:
    """Return options of a field, with `value` and `write` bound to an attribute of `owner`.

    A `value` in `options` is shown instead of the attribute. For a frozen `owner`, `change` is
    called as change(name=value).
    """

    def write(value: Any) -> None:
        if change is not None:
            change(**{name: value})
        else:
            setattr(owner, name, value)

    return {"value": getattr(owner, name), "write": write, **options}


def options_of(names: Mapping[Any, str]) -> dict[str, Any]:
    """Return the options of a field: the keys of `names`, labelled with their names."""
    return {"options": list(names), "format_func": lambda key: names.get(key, key)}
