"""Sessions of the dashboard without a browser, which exchange the messages of a browser.

A session opens pages, changes widgets, uploads files, and repeats the runs that the page requests,
until the page is at rest. The content of the page can then be read: pictures of maps, errors,
texts.
"""

from __future__ import annotations

import json
import time
import urllib.request
import uuid
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from streamlit.components.v2.bidi_component.constants import EVENT_DELIM
from streamlit.proto.BackMsg_pb2 import BackMsg
from streamlit.proto.ClientState_pb2 import ClientState
from streamlit.proto.Element_pb2 import Element
from streamlit.proto.ForwardMsg_pb2 import ForwardMsg
from streamlit.proto.Selectbox_pb2 import Selectbox
from streamlit.proto.WidgetStates_pb2 import WidgetState
from streamlit.runtime.state.session_state import STREAMLIT_INTERNAL_KEY_PREFIX
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from ccwsim.system.memory import used_memory

PATIENCE = 300.0
"""Seconds after which a page that is not at rest is given up."""
COOKIE = "_streamlit_xsrf"


class Stuck(RuntimeError):
    """Error raised if a page does not come to rest, or lacks a requested element."""


@dataclass
class Session:
    """One tab of one user.

    Parameters
    ----------
    address : str
        Address of the server, such as http://127.0.0.1:8501.
    page : str
        Name of a page in the address, such as "validate".
    query : str
        Query of the address.

    Attributes
    ----------
    elements : dict of tuple to Element
        Elements of the page, by position.
    errors : list of str
        Errors that Streamlit itself has shown since the session began.
    received : list of bytes, optional
        List to which every received message is appended.
    """

    address: str
    page: str = "simulate"
    query: str = ""
    elements: dict[tuple[int, ...], Element] = field(default_factory=dict)
    errors: list[str] = field(default_factory=list)
    received: list[bytes] | None = None

    def __enter__(self) -> Session:
        where = urlsplit(self.address)
        self._cookie = self._xsrf()
        connection = self._connect(
            f"ws://{where.netloc}/_stcore/stream", max_size=None,
            subprotocols=[Subprotocol("streamlit")],
            additional_headers={"Origin": self.address, "Cookie": f"{COOKIE}={self._cookie}"},
            compression=None, open_timeout=PATIENCE, close_timeout=5, ping_interval=None,
        )  # fmt: skip
        self._opened = ExitStack()
        self._socket = self._opened.enter_context(connection)
        self._states: dict[str, WidgetState] = {}
        self._repeats: dict[str, float] = {}
        self._menus: dict[str, str] = {}
        self._fragments: dict[str, str] = {}  # fragment in which a component is drawn, by its id
        self._script, self._id, self._running = "", "", False
        return self

    def __exit__(self, *error: object) -> None:
        self._opened.close()

    def open(
        self, page: str | None = None, query: str | None = None, *, settle: bool = True
    ) -> Session:
        """Open a page and wait until it is at rest; without `settle`, only until it is drawn."""
        self.page = self.page if page is None else page
        self.query = self.query if query is None else query
        self._script = ""
        self._states.clear()
        self._ask()
        if settle:
            return self.settle()
        self._finish()
        return self

    def change(self, **values: object) -> Session:
        """Set several widgets at once by their keys, and wait until the page is at rest."""
        for name, value in values.items():
            self._set(name, value)
        self._ask()
        self._states = {k: s for k, s in self._states.items() if not s.trigger_value}
        return self.settle()

    def click(self, name: str) -> Session:
        """Press a button."""
        return self.change(**{name: "pressed"})

    def report(self, name: str, event: str, value: object) -> Session:
        """Let a component report a value, as a canvas does, and wait until that is drawn."""
        widget = self.widget(name)
        state = WidgetState(id=f"{STREAMLIT_INTERNAL_KEY_PREFIX}_{widget.id}{EVENT_DELIM}events")
        state.json_trigger_value = json.dumps([{"event": event, "value": value}])
        self._states[state.id] = state
        self._ask(fragment=self._fragments.get(widget.id, ""))
        del self._states[state.id]
        self._finish()
        return self

    def upload(self, name: str, file_name: str, content: bytes) -> Session:
        """Upload a file to an uploader, whose menu is opened first."""
        self._open_menu(f"{name.removesuffix('_file')}_menu")
        widget = self.widget(name)
        urls = self.send(file_name, content)
        state = WidgetState(id=widget.id)
        state.file_uploader_state_value.uploaded_file_info.add(
            name=file_name, size=len(content), file_id=urls.file_id, file_urls=urls
        )
        self._states[widget.id] = state
        self._ask()
        return self.settle()

    def send(self, file_name: str, content: bytes) -> Any:
        """Upload a file for no widget; return its addresses and its name on the server."""
        message = BackMsg()
        message.file_urls_request.request_id = uuid.uuid4().hex
        message.file_urls_request.file_names.append(file_name)
        message.file_urls_request.session_id = self._id
        self._socket.send(message.SerializeToString())
        (urls,) = self._until("file_urls_response").file_urls_response.file_urls
        self._put(urls.upload_url, file_name, content)
        return urls

    def settle(self) -> Session:
        """Repeat the runs that the page requests until the page requests none."""
        end = time.monotonic() + PATIENCE
        self._finish()
        while self._repeats:
            if time.monotonic() > end:
                raise Stuck(f"{self.page}?{self.query} did not come to rest: {self.words()[:20]}")
            name, interval = min(self._repeats.items(), key=lambda pair: pair[1])
            self._take_until(time.monotonic() + interval)
            if name in self._repeats:
                self._ask(fragment=name, repeats=True)
            self._finish()
        return self

    # what is on the page

    def widget(self, name: str) -> Any:
        """Return a widget by its key; a widget that replaced another has spaces after its key."""
        found = [w for w in map(_content, self.elements.values()) if _key(w) == name]
        if not found:
            raise Stuck(f"there is no {name} on {self.page}; it says {self.words()[:20]}")
        return found[-1]

    def part(self, name: str) -> dict[str, Any]:
        """Return the data of a component of the page, by its key."""
        return json.loads(self.widget(name).json)

    def words(self) -> list[str]:
        """Return all texts in alerts and HTML."""
        kinds = {"alert": "body", "html": "body", "markdown": "body"}
        contents = ((e.WhichOneof("type"), _content(e)) for e in self.elements.values())
        said = [getattr(c, kinds[kind]).lstrip() for kind, c in contents if kind in kinds]
        return [text for text in said if not text.startswith(("<style", "<script", "<i></i>"))]

    def alerts(self) -> list[str]:
        """Return the texts of errors and warnings."""
        return [e.alert.body for e in self.elements.values() if e.HasField("alert")]

    def styles(self) -> list[str]:
        """Return the content of style sheets and style attributes of the page."""
        bodies = [e.html.body for e in self.elements.values() if e.HasField("html")]
        return [body for body in bodies if "style" in body]

    # messages

    def _ask(self, fragment: str = "", repeats: bool = False) -> None:
        message = BackMsg()
        state: ClientState = message.rerun_script
        state.query_string = self.query
        if self._script:
            state.page_script_hash = self._script
        else:
            state.page_name = self.page
        state.fragment_id = fragment
        state.is_auto_rerun = repeats
        state.context_info.url = f"{self.address}/{self.page}"
        state.widget_states.widgets.extend(self._states.values())
        self._running = True
        self._socket.send(message.SerializeToString())

    def _open_menu(self, name: str) -> None:
        """Open a menu whose fields are drawn only while it is open."""
        if name in self._menus:
            state = WidgetState(id=self._menus[name], bool_value=True)
            self._states[state.id] = state
            for _ in range(2):  # the first request may run app.py, which forgets open menus
                self._ask()
                self.settle()

    def _set(self, name: str, value: object) -> None:
        widget = self.widget(name)
        state = WidgetState(id=widget.id)
        if value == "pressed":
            state.trigger_value = True
        elif isinstance(widget, Selectbox):
            state.string_value = str(value)
        elif isinstance(value, bool):
            state.bool_value = value
        elif isinstance(value, int):
            state.int_value = value
        elif isinstance(value, float):
            state.double_value = value
        else:
            state.string_value = str(value)
        self._states[widget.id] = state

    def _finish(self) -> None:
        """Wait until no run is active; a run that requests another run is not the last."""
        while self._running:
            self._until("script_finished")

    def _until(self, kind: str) -> ForwardMsg:
        end = time.monotonic() + PATIENCE
        while True:
            message = self._next(end - time.monotonic())
            if message is None:
                raise Stuck(f"{self.page}?{self.query}: no {kind}")
            if message.WhichOneof("type") == kind:
                return message

    def _take_until(self, end: float) -> None:
        while self._next(max(end - time.monotonic(), 0.0)) is not None:
            pass

    def _next(self, seconds: float) -> ForwardMsg | None:
        try:
            content = self._socket.recv(timeout=max(seconds, 0.0))
        except TimeoutError:
            return None
        if self.received is not None:
            self.received.append(bytes(content))  # type: ignore[arg-type]
        message = ForwardMsg()
        message.ParseFromString(content)  # type: ignore[arg-type]
        self._take(message)
        return message

    def _take(self, message: ForwardMsg) -> None:
        kind = message.WhichOneof("type")
        if kind == "new_session":
            self._begin(message)
        elif kind == "delta":
            self._draw(message)
        elif kind == "auto_rerun":
            self._repeats[message.auto_rerun.fragment_id] = message.auto_rerun.interval
        elif kind == "stop_auto_rerun":
            for name in message.stop_auto_rerun.fragment_ids:
                self._repeats.pop(name, None)
        elif kind == "page_info_changed":
            self.query = message.page_info_changed.query_string
        elif kind == "script_finished":
            self._running = message.script_finished == ForwardMsg.FINISHED_EARLY_FOR_RERUN
        elif kind == "session_event":
            event = message.session_event
            if event.HasField("script_compilation_exception"):
                self.errors.append(event.script_compilation_exception.message)

    def _begin(self, message: ForwardMsg) -> None:
        self._running = True
        new = message.new_session
        pages = {each.url_pathname: each.page_script_hash for each in new.app_pages}
        self._script = pages.get(self.page, new.page_script_hash)
        self._id = new.initialize.session_id or self._id
        if not message.metadata.run.fragment_ids:
            self.elements.clear()
            self._repeats.clear()

    def _draw(self, message: ForwardMsg) -> None:
        place = tuple(message.metadata.delta_path)
        kind = message.delta.WhichOneof("type")
        for other in [p for p in self.elements if p[: len(place)] == place]:
            if kind == "new_element" or other == place:
                del self.elements[other]
        if kind == "add_block" and message.delta.add_block.HasField("popover"):
            menu = message.delta.add_block.popover
            self._menus[_key(menu)] = menu.id
        if kind == "new_element":
            element = self.elements[place] = message.delta.new_element
            if element.HasField("bidi_component"):
                self._fragments[element.bidi_component.id] = message.delta.fragment_id
            if message.delta.new_element.HasField("exception"):
                self.errors.append(message.delta.new_element.exception.message)

    # files

    def _xsrf(self) -> str:
        with self._ask_for(urllib.request.Request(f"{self.address}/_stcore/health")) as answer:
            for line in answer.headers.get_all("Set-Cookie") or ():
                if line.startswith(f"{COOKIE}="):
                    return line.split(";")[0].removeprefix(f"{COOKIE}=").strip(chr(34))
        return ""

    def _put(self, url: str, name: str, content: bytes) -> None:
        edge = uuid.uuid4().hex
        head = (f'--{edge}\r\nContent-Disposition: form-data; name="{name}"; filename="{name}"\r\n'
                "Content-Type: application/octet-stream\r\n\r\n")  # fmt: skip
        request = urllib.request.Request(
            f"{self.address}{url}", head.encode() + content + f"\r\n--{edge}--\r\n".encode(),
            {"Content-Type": f"multipart/form-data; boundary={edge}", "X-Xsrftoken": self._cookie,
             "Cookie": f"{COOKIE}={self._cookie}"}, method="PUT",
        )  # fmt: skip
        with self._ask_for(request):
            pass

    def _connect(self, url: str, **options: Any) -> Any:
        return connect(url, **options)

    def _ask_for(self, request: urllib.request.Request) -> Any:
        return urllib.request.urlopen(request, timeout=PATIENCE)


def _content(element: Element) -> Any:
    return getattr(element, element.WhichOneof("type") or "empty")


def _key(content: Any) -> str:
    """Return the key of a widget, which is the end of its id."""
    whole = str(getattr(content, "id", ""))
    return whole.split("-", 2)[2].rstrip() if whole.startswith("$$ID-") else ""


def resident(pid: int) -> int:
    """Return the resident memory of a process in bytes."""
    held = used_memory(process=pid)
    assert held is not None, f"process {pid} has ended"
    return held
