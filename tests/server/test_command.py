"""The command `serve`: one link, clear sentences, a clean end."""

import signal
import subprocess
import tempfile
from pathlib import Path

import httpx
import psutil
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from tests.server.command import Wish, link, refused, serving
from tests.server.host import begin
from tests.waiting import wait_for


def workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    found = psutil.Process(process.pid).children(recursive=True)
    assert len(found) >= 2  # forkserver and worker
    return found


def test_a_life(tmp_path: Path) -> None:
    """Interrupted, it ends cleanly and leaves nothing behind.

    Its link is printed when it can be reached, with a token where it is bound to all interfaces, and nothing works
    without that. Meanwhile no other server takes its data, and what strangers ask for is no mistake of the server.
    """
    wish = f"port=0, data_dir=Path({str(tmp_path / 'data')!r})"
    # The names of sockets may be 107 characters long, so not within the test's own directory.
    with tempfile.TemporaryDirectory() as name:
        with serving(f"host='0.0.0.0', {wish}", TMPDIR=name) as process:
            address = link(process)
            assert "?token=" in address
            bare = address.partition("?")[0]
            with httpx.Client(base_url=bare, timeout=60, follow_redirects=True) as client:
                assert client.get(bare).status_code == 401
                assert client.get(address).status_code == 200  # from here on a cookie says it
                assert "in use by another" in refused(Wish(wish))[0]
                begin(client)
                known = {"Cookie": "; ".join(f"{name}={value}" for name, value in client.cookies.items())}
            scene = bare.replace("http", "ws") + "viz/x"
            for _ in range(20):
                with pytest.raises(InvalidStatus):
                    connect(scene, origin=Origin("http://evil.example"), additional_headers=known, proxy=None)
            workers = workers_of(process)
            assert list(Path(name).iterdir())
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
            wait_for(lambda: not any(worker.is_running() for worker in workers))
            _, log = process.communicate(timeout=60)
        assert list(Path(name).iterdir()) == []
    lines = [line for line in log.splitlines() if "level=info" not in line]
    assert len(lines) == 1, log  # many refused websockets are one warning that says why
    assert "another site" in lines[0]
