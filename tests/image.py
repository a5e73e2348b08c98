"""The image built and run as it is meant to be, by Debian's own tools, without a daemon and a registry of images."""

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import psutil

from tests.waiting import wait_for

ROOT = Path(__file__).parents[1]
KEPT = Path("~/.cache/pftrack-tests").expanduser()
"""For what takes long to get and stays the same: a Debian, and the packages that are installed."""

TOOLS = ("buildah", "debootstrap", "unshare", "nsenter", "chroot", "tar")
PACKAGES = "python3,python3-venv,ca-certificates"
LEFT_OUT = "var/cache/apt", "var/lib/apt/lists", *(f"usr/share/{it}" for it in ("doc", "info", "locale", "man"))
CERTIFICATES = Path("/etc/ssl/certs/ca-certificates.crt")
INDEXES = ("PIP_INDEX_URL", "UV_DEFAULT_INDEX")

CONFINED = 'setpriv --reuid="$UID_" --regid="$GID_" --clear-groups --no-new-privs --inh-caps=-all --bounding-set=-all'
"""As a container's process is with `cap_drop: [ALL]` and `no-new-privileges`."""

RUN = f"""
set -eu
mount --bind "$IMAGE" "$IMAGE"
mount -o remount,bind,ro "$IMAGE"
mount --bind "$DATA" "$IMAGE/data"
mount -t proc proc "$IMAGE/proc"
mount -t tmpfs -o mode=1777,nosuid,nodev,noexec tmpfs "$IMAGE/tmp"
mount --rbind /dev "$IMAGE/dev"
exec chroot "$IMAGE" {CONFINED} env --ignore-environment --chdir=/data "$@"
"""
EXECUTE = f'exec {CONFINED} env --ignore-environment --chdir=/data "$@"'


class Image(NamedTuple):
    """An image that was built.

    Attributes:
        root: Its files.
        config: How it is to be run.
        size: Bytes of its layers, including those of its base, unpacked.
    """

    root: Path
    config: Mapping[str, Any]
    size: int

    def environment(self, **more: str) -> list[str]:
        """Return the environment of its processes as arguments of `env`."""
        return [*self.config["Env"], *(f"{name}={value}" for name, value in more.items())]

    @property
    def user(self) -> dict[str, str]:
        """Who its processes are, for `CONFINED`."""
        return dict(zip(("UID_", "GID_"), self.config["User"].split(":"), strict=True))


class Container(NamedTuple):
    """A container that runs.

    Attributes:
        image: What it was made of.
        outside: The process that waits for it.
        pid: Its first process, as it is seen from outside.
        environment: The environment of its processes.
    """

    image: Image
    outside: "subprocess.Popen[str]"
    pid: int
    environment: list[str]

    def execute(self, *command: str) -> "subprocess.CompletedProcess[str]":
        """Run a command in it, as `docker exec` does."""
        root = f"/proc/{self.pid}/root"
        enter = ["nsenter", f"--target={self.pid}", "--mount", "--pid", f"--root={root}", f"--wd={root}"]
        return subprocess.run(
            [*enter, "sh", "-c", EXECUTE, "sh", *self.environment, *command],
            env={**os.environ, **self.image.user},
            capture_output=True,
            text=True,
            check=False,
            timeout=600,
        )


def lacking() -> str | None:
    """Return what this machine lacks for building an image, if anything."""
    path = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"
    if missing := [tool for tool in TOOLS if not shutil.which(tool, path=path)]:
        return f"{', '.join(missing)} cannot be found"
    if os.geteuid() != 0:
        return "only root may build and run an image without a daemon"
    if subprocess.run(["unshare", "--mount", "--pid", "--fork", "true"], capture_output=True, check=False).returncode:
        return "this machine allows no mounts"
    return None


def debian() -> Path:
    """Return an archive of a small Debian with Python, made from the packages that this machine has its own from.

    Raises:
        OSError: It cannot be made.
    """
    version = dict(line.split("=", 1) for line in Path("/etc/os-release").read_text().splitlines() if "=" in line)
    suite = version.get("VERSION_CODENAME", "").strip('"')
    archive = KEPT / f"debian-{suite}-{PACKAGES.replace(',', '-')}.tar"
    if archive.exists():
        return archive
    asked = ["apt-get", "indextargets", "--format", "$(REPO_URI)", "Origin: Debian", f"Release: {suite}"]
    found = subprocess.run(asked, capture_output=True, text=True, check=False).stdout.split()
    if not found:
        raise OSError(f"no Debian packages of {suite or 'this system'} are known to apt-get")
    KEPT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=KEPT) as place:
        root = Path(place, "root")
        make = ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", suite, str(root), found[0]]
        made = subprocess.run(make, capture_output=True, text=True, check=False)
        if made.returncode:
            raise OSError(f"debootstrap failed: {made.stdout.strip().splitlines()[-1:]}")
        # What images of Debian leave out, too.
        for folder in (root / it for it in LEFT_OUT):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        unfinished = Path(place, "archive")
        subprocess.run(["tar", "--create", "--file", unfinished, "--directory", root, "."], check=True)
        unfinished.rename(archive)
    return archive


def build(base: Path, place: Path) -> Image:
    """Build the image.

    Args:
        base: The archive of a Debian.
        place: For its files, a few gigabytes.
    """
    kept = {**os.environ, "TMPDIR": str(KEPT)}  # where buildah has its caches

    def buildah(command: str, *arguments: str | Path) -> str:
        store = ["--root", place / "images", "--runroot", place / "run", "--storage-driver", "vfs"]
        done = subprocess.run(
            ["buildah", *store, command, *arguments], cwd=ROOT, env=kept, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout[-10_000:] + done.stderr[-10_000:]
        return done.stdout.strip()

    empty = buildah("from", "scratch")
    buildah("add", "--quiet", empty, base, "/")
    buildah("commit", "--quiet", "--rm", empty, "base")
    given = [f"--build-arg={name}={os.environ[name]}" for name in INDEXES if name in os.environ]
    options = ["--isolation=chroot", "--format=docker", "--pull-never", "--build-arg=BASE=localhost/base", *given]
    secret = f"--secret=id=certificates,src={CERTIFICATES}"
    buildah("build", *options, secret, "--file=docker/Dockerfile", "--tag=pftrack")
    told = json.loads(buildah("inspect", "--type=image", "pftrack"))
    size = sum(layer["size"] for layer in json.loads(told["Manifest"])["layers"])
    container = buildah("from", "--pull-never", "localhost/pftrack")
    return Image(Path(buildah("mount", container)), told["Docker"]["config"], size)


@contextmanager
def running(image: Image, data: Path, **variables: str) -> Iterator[Container]:
    """Run the entry point with a root that is read-only, for as long as the context lasts.

    Args:
        image: What is run.
        data: The folder that is its volume.
        variables: Further environment variables.
    """
    environment = image.environment(**variables)
    command = [*environment, *image.config["Entrypoint"], *image.config["Cmd"]]
    apart = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]
    with subprocess.Popen(
        [*apart, "sh", "-c", RUN, "sh", *command],
        env={**os.environ, **image.user, "IMAGE": str(image.root), "DATA": str(data)},
        stdout=subprocess.PIPE,
        text=True,
    ) as outside:
        waiting = psutil.Process(outside.pid)
        try:
            first = wait_for(waiting.children, what="the container begins")
            yield Container(image, outside, first[0].pid, environment)
        finally:
            # A container ends with its first process, and so does who waits for that.
            for inside in waiting.children() if outside.poll() is None else ():
                inside.kill()
