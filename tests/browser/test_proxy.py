"""Test the dashboard behind nginx, configured as in deploy/: pages open, private paths do not."""

from __future__ import annotations

import os
import shutil
import ssl
import subprocess
import time
import tomllib
import urllib.error
import urllib.request
from io import BytesIO
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from websockets.exceptions import InvalidMessage, InvalidStatus
from websockets.sync.client import connect

from tests.browser.served import CHROMIUM, ROOT, free_port
from tests.ui.sessions import Session

NGINX, OPENSSL = shutil.which("nginx", path="/usr/sbin:/usr/bin:/bin"), shutil.which("openssl")
pytestmark = pytest.mark.skipif(not (NGINX and OPENSSL), reason="there is no nginx or openssl")
SMALL = "grid=64x48&data=none&template=16&overlap=4&realizations=3&seed=4"
NAME = "localhost"
HEADERS = {
    "content-security-policy": "frame-ancestors 'none'",
    "strict-transport-security": "max-age=31536000",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
}


@pytest.fixture(scope="module")
def proxy(address, tmp_path_factory):
    """Yield the address of nginx, which runs on free ports with a certificate of the test."""
    folder = tmp_path_factory.mktemp("nginx")
    plain, secure = free_port(), free_port()
    key, certificate = folder / "key.pem", folder / "cert.pem"
    subprocess.run(
        [OPENSSL, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj",
         f"/CN={NAME}", "-addext", f"subjectAltName=DNS:{NAME}", "-keyout", key,
         "-out", certificate], check=True, capture_output=True,
    )  # fmt: skip
    (folder / "nginx.conf").write_text(whole(site(address, plain, secure, key, certificate)))
    command = [NGINX, "-p", str(folder), "-c", str(folder / "nginx.conf"), "-e", "stderr"]
    tested = subprocess.run([*command, "-t"], capture_output=True, text=True)
    assert tested.returncode == 0, tested.stderr
    server = subprocess.Popen([*command, "-g", "daemon off;"], stderr=subprocess.DEVNULL)
    try:
        until_there(f"https://{NAME}:{secure}")
        yield f"https://{NAME}:{secure}", f"http://127.0.0.1:{plain}"
    finally:
        server.terminate()
        server.wait(20)


def site(address: str, plain: int, secure: int, key: Path, certificate: Path) -> str:
    """Return the configuration of deploy/ with the host name, ports and certificate of the test."""
    text = (ROOT / "deploy" / "nginx.conf").read_text("utf-8")
    for old, new in (
        ("listen 80;", f"listen 127.0.0.1:{plain};"),
        ("listen 443 ssl", f"listen 127.0.0.1:{secure} ssl"),
        ("server 127.0.0.1:8501;", f"server {urlsplit(address).netloc};"),
        ("/etc/letsencrypt/live/ccwsim.example.org/fullchain.pem", str(certificate)),
        ("/etc/letsencrypt/live/ccwsim.example.org/privkey.pem", str(key)),
        ("server_name ccwsim.example.org;", f"server_name {NAME};"),
    ):
        assert old in text
        text = text.replace(old, new)
    return text


def whole(text: str) -> str:
    # workers write large answers to folders that only the user of this test may write to
    user = "user root;" if hasattr(os, "geteuid") and os.geteuid() == 0 else ""
    return f"""
{user}
worker_processes 1;
pid nginx.pid;
events {{ worker_connections 512; }}
http {{
    access_log off;
    client_body_temp_path body; proxy_temp_path proxy; fastcgi_temp_path fastcgi;
    uwsgi_temp_path uwsgi; scgi_temp_path scgi;
{text}
}}
"""


def trusting() -> ssl.SSLContext:
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context


def until_there(address: str) -> None:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        try:
            asked(f"{address}/_stcore/health")
            return
        except OSError:
            time.sleep(0.1)
    raise RuntimeError("nginx did not answer")


def asked(url: str, **options):
    request = urllib.request.Request(url, **options)
    return urllib.request.urlopen(request, timeout=60, context=trusting())


@pytest.mark.slow
@pytest.mark.parametrize("path", ["/", "/validate", "/_stcore/health", "/_stcore/host-config"])
def test_pages_come_with_the_headers_that_protect_them(proxy, path):
    with asked(proxy[0] + path) as answer:
        assert answer.status == 200
        for name, part in HEADERS.items():
            assert part in answer.headers[name]
        assert "uvicorn" not in str(answer.headers)
        assert not any(sign.isdigit() for sign in answer.headers["server"])


@pytest.mark.slow
def test_a_missing_page_and_closed_doors(proxy):
    for path in ("/_stcore/metrics", "/_stcore/agent/interact"):
        with pytest.raises(urllib.error.HTTPError, match="404") as error:
            asked(proxy[0] + path)
        assert error.value.headers["x-content-type-options"] == "nosniff"


@pytest.mark.slow
def test_plain_http_leads_to_https(proxy):
    import http.client

    there = http.client.HTTPConnection(urlsplit(proxy[1]).netloc, timeout=60)
    there.request("GET", "/simulate?seed=3", headers={"Host": NAME})
    answer = there.getresponse()
    assert answer.status == 301
    assert answer.headers["location"] == f"https://{NAME}/simulate?seed=3"


class Secure(Session):
    """A session of the dashboard through the proxy."""

    def _connect(self, url: str, **options):
        for tries_left in (2, 1, 0):
            try:
                return connect(url.replace("ws://", "wss://"), ssl=trusting(), **options)
            except InvalidMessage:  # closed without an answer; a browser also retries
                if not tries_left:
                    raise
        raise AssertionError

    def _ask_for(self, request):
        return urllib.request.urlopen(request, timeout=60, context=trusting())


@pytest.mark.slow
def test_a_study_runs_and_a_file_is_taken_through_the_proxy(proxy):
    with Secure(proxy[0], "simulate", SMALL) as session:
        session.open()
        assert session.part("map_realization")["nx"] == 64
        file = BytesIO()
        np.save(file, np.kron(np.eye(8, dtype=int), np.ones((12, 12), int)))
        session.upload("image_file", "own.npy", file.getvalue())
        assert "96 × 96" in "".join(session.words())


@pytest.mark.slow
def test_a_file_that_is_too_large_and_a_foreign_page_are_refused(proxy):
    with pytest.raises(urllib.error.HTTPError, match="413"):
        asked(f"{proxy[0]}/simulate", data=b"0" * (2 << 20), method="POST")
    where = proxy[0].replace("https", "wss") + "/_stcore/stream"
    with pytest.raises(InvalidStatus, match="403"):
        connect(where, ssl=trusting(), additional_headers={"Origin": "https://e.vil"})


@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}")
def test_a_browser_finds_nothing_forbidden_by_the_policy(proxy, chromium):
    from tests.browser.hands import SLOW, at_rest

    said: list[str] = []
    failed: list[str] = []
    page = chromium.new_context(ignore_https_errors=True).new_page()
    page.on("console", lambda message: said.append(message.text))
    page.on("requestfailed", lambda request: failed.append(request.url))
    for name in ("simulate", "data", "validate", "compare", "how_it_works", "benchmark"):
        page.goto(f"{proxy[0]}/{name}?{SMALL}")
        page.locator(".st-key-menu").first.wait_for(timeout=SLOW)
        at_rest(page)
        if name == "simulate":
            page.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
            page.wait_for_selector(".chart .main-svg", timeout=SLOW)
            assert failed == []
    page.context.close()
    assert [text for text in said if "Content Security Policy" in text] == []


def test_the_notes_for_other_servers_say_the_same():
    nginx, caddy = ((ROOT / "deploy" / name).read_text() for name in ("nginx.conf", "Caddyfile"))
    policy = nginx.split('Content-Security-Policy "')[1].split('"')[0]
    assert policy in caddy
    settings = tomllib.loads((ROOT / ".streamlit" / "config.toml").read_text("utf-8"))
    limit = settings["server"]["maxUploadSize"]
    assert f"client_max_body_size {limit + 1}m;" in nginx
    assert f"max_size {limit + 1}MB" in caddy
