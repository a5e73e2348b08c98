"""A real nginx with TLS in front of servers, each set up as docs/how-to/server.md says."""

import os
import re
import shutil
import socket
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import unquote

from tests.waiting import wait_for

NGINX = shutil.which("nginx", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "server.md"

CONFIGURATION = """
daemon off;
{user}
pid {folder}/nginx.pid;
error_log {folder}/error.log;
events {{}}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    {sites}
}}
"""


def site(port: int, upstream: int, path: str, *, takes_off: bool = False) -> str:
    """Return the configuration of one site, which is the one that the page on the server shows.

    Args:
        port: Where nginx listens.
        upstream: Where the server listens.
        path: Below which nginx passes on what is asked for, encoded.
        takes_off: Whether it takes the path off and says so, as the page describes as the other way.
    """
    shown = re.search(r"```nginx\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert shown
    changes = {
        "listen 443 ssl": f"listen 127.0.0.1:{port} ssl",
        "lab.example;": "localhost;",
        "/etc/ssl/certs/lab.example.pem": "certificate.pem",
        "/etc/ssl/private/lab.example.key": "key.pem",
        "location /tracking/": f'location "{unquote(path)}/"',
        "http://127.0.0.1:8000;": f"http://127.0.0.1:{upstream}{'/' if takes_off else ''};",
        **({'X-Forwarded-Prefix ""': f'X-Forwarded-Prefix "{path}"'} if takes_off else {}),
    }
    text = shown[1]
    for before, after in changes.items():
        assert before in text, before
        text = text.replace(before, after)
    return text


@contextmanager
def nginx(folder: Path, sites: Mapping[int, str]) -> Iterator[None]:
    """Run nginx for as long as the context lasts.

    Args:
        folder: For its files, and its certificate.
        sites: The configuration of each site, by its port.
    """
    assert NGINX
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    files = ["-keyout", str(folder / "key.pem"), "-out", str(folder / "certificate.pem")]
    making = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", *subject, *files]
    subprocess.run(making, check=True, capture_output=True)
    # What all sites share stands before the first of them.
    common, _, _ = next(iter(sites.values())).partition("server {")
    parts = [common, *(text.removeprefix(common) for text in sites.values())]
    user = "user root;" if os.geteuid() == 0 else ""
    path = folder / "nginx.conf"
    path.write_text(CONFIGURATION.format(folder=folder, user=user, sites="\n".join(parts)))
    # The first error log is opened before the configuration is read.
    command = [NGINX, "-c", str(path), "-p", str(folder), "-e", str(folder / "error.log")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            wait_for(lambda: process.poll() is not None or all(map(_is_open, sites)), what="nginx listens")
            assert process.poll() is None, process.stderr and process.stderr.read()
            yield
        finally:
            process.terminate()


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
        return port


def _is_open(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
