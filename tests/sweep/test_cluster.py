"""A sweep on a Dask cluster: real scheduler and workers, one of them lost, all of them lost, none there."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import psutil
import pytest

from pftrack.core.model.recipe import Footage
from pftrack.reproduce.pool import Pool
from pftrack.sources.sequence import Recording, open_sequence
from pftrack.sweep import Plan, Result, carry_out, resume
from pftrack.sweep.axis import SweepError
from pftrack.sweep.driver import Progress
from tests.nginx import free_port
from tests.server.uploads.test_uploads import video
from tests.sweep.test_driver import cut

# Looked for and not imported, which takes a second: each worker of pytest would do so to collect these tests.
pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="needs the package distributed")

QUIET = {**os.environ, "DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "critical"}
START_S = 120
PROGRAM = """
import os, sys
import distributed.cli.dask_scheduler, distributed.cli.dask_worker
import pftrack
pftrack.run("ball", frames=2)
for line in sys.stdin:
    what, *arguments = line.split()
    pid = os.fork()
    if not pid:
        getattr(distributed.cli, what).main(arguments)
    print(pid, flush=True)
"""


class Cluster:
    """A scheduler and workers, with the commands of `docker/compose.yaml`.

    Each is a process of its own, forked from one that has imported everything.
    """

    def __init__(self, workers: int) -> None:
        port = free_port()
        self.address = f"tcp://127.0.0.1:{port}"
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        command = [sys.executable, "-c", PROGRAM]
        self._process = subprocess.Popen(command, **pipes, text=True, env=QUIET, start_new_session=True)
        self._start(f"dask_scheduler --host 127.0.0.1 --port {port} --no-dashboard")
        alone = "--nthreads 1 --no-nanny --no-dashboard --death-timeout 60"
        self.workers = [self._start(f"dask_worker {self.address} {alone}") for _ in range(workers)]

    def _start(self, line: str) -> int:
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        return int(self._process.stdout.readline())

    def end(self) -> None:
        """End all its processes."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.communicate()


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    """A cluster of two workers, which the tests below lose one after the other."""
    made = Cluster(workers=2)
    yield made
    made.end()


def wait_for(cluster: Cluster, workers: int) -> None:
    from distributed import Client

    with Client(cluster.address, timeout=START_S, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=START_S)


def test_a_recording_comes_to_the_workers(cluster: Cluster, tmp_path: Path) -> None:
    """They share no disk with the driver, and their rows are those of this machine."""
    clip = tmp_path / "ball.mp4"
    clip.write_bytes(video(12))
    with closing(open_sequence(clip)) as sequence:
        mark = {"kind": "box", "x": 10, "y": 20, "width": 10, "height": 10}
        footage = Footage(sha256=sequence.sha256, name="ball.mp4", start=1, mark=mark)
    plan = Plan("histogram", trials=3, frames=8, values={"sample_count": 30}, footage=footage, kind="video")
    here, there = (
        carry_out(plan, tmp_path / name, cluster=address, recording=Recording(str(clip))).table["estimates_sha256"]
        for name, address in (("here.parquet", None), ("there.parquet", cluster.address))
    )
    assert here.to_pylist() == there.to_pylist()


def test_who_sends_work_to_a_cluster_listens_nowhere(cluster: Cluster) -> None:
    """The scheduler's answers come back on the connection that was made to it, so nobody can connect to the sweep.

    A reproduction by the workers of a scheduler has the results of one process.
    """
    from pftrack.sweep.cluster import ClusterWorkers

    wait_for(cluster, 1)
    with Pool(1, cluster=cluster.address) as pool:
        assert pool.map(abs, range(-20, 20)) == [abs(number) for number in range(-20, 20)]
        assert pool.pieces == 40
    before = listening()
    workers = ClusterWorkers(cluster.address)
    assert listening() == before
    workers.close()


def listening() -> set[object]:
    connections = psutil.Process().net_connections("inet")
    return {each.laddr for each in connections if each.status == psutil.CONN_LISTEN}


def test_a_worker_is_lost(cluster: Cluster, plan: Plan, finished: Result, tmp_path: Path) -> None:
    """One of two workers is killed in the middle; the other takes over its chunk, and the rows are the same."""
    wait_for(cluster, 2)
    killed: list[int] = []

    def kill(progress: Progress) -> None:
        if progress.done and not killed:
            killed.append(cluster.workers[0])
            os.kill(cluster.workers[0], signal.SIGKILL)

    out = cut(plan, tmp_path / "cluster.parquet")
    result = carry_out(None, out, cluster=cluster.address, progress=kill)
    assert killed
    assert result.table.drop_columns("step_ms") == finished.table.drop_columns("step_ms")


def test_a_cluster_goes_away(cluster: Cluster, plan: Plan, finished: Result, tmp_path: Path) -> None:
    """Scheduler and workers die in the middle: one sentence, and this machine goes on from there."""
    wait_for(cluster, 1)

    def end(progress: Progress) -> None:
        if progress.done >= 8:
            cluster.end()

    out = cut(plan, tmp_path / "away.parquet")
    with pytest.raises(SweepError, match=rf"the cluster at {cluster.address} went away; what was computed is kept"):
        carry_out(None, out, cluster=cluster.address, progress=end)
    assert len(list(resume(out).folder.glob("0*.parquet"))) >= 2
    result = carry_out(None, out)
    assert result.table.drop_columns("step_ms") == finished.table.drop_columns("step_ms")


def test_without_a_cluster_nothing_is_begun(plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no scheduler answers, a new sweep has not begun, an old one is kept, and no process is left.

    Without the package distributed a sentence says what to install.
    """
    address = f"tcp://127.0.0.1:{free_port()}"
    out = tmp_path / "nobody.parquet"
    before = set(psutil.Process().children())
    with pytest.raises(SweepError, match=rf"no Dask scheduler answers at {address}"):
        carry_out(plan, out, cluster=address)
    assert not list(tmp_path.iterdir())
    cut(plan, out)
    with pytest.raises(SweepError, match="no Dask scheduler answers at nonsense"):
        carry_out(None, out, cluster="nonsense")
    assert set(psutil.Process().children()) <= before
    assert carry_out(None, out).complete
    monkeypatch.delitem(sys.modules, "pftrack.sweep.cluster")
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SweepError, match=r"which is not installed; pip install 'pftrack\[cluster\]'"):
        carry_out(plan, tmp_path / "x.parquet", cluster=address)
