"""Settings: the configuration of a server, in one class that refuses unsafe combinations.

Each field can be given as an environment variable with the prefix `PFTRACK_`, as in `PFTRACK_MAX_SESSIONS=8`.
"""

import ipaddress
import os
import secrets
from pathlib import Path
from typing import Annotated, Self
from urllib.parse import urlencode

from pydantic import AfterValidator, Field, SecretStr, ValidationInfo, field_validator, model_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from pftrack_server.core.base_path import encode_path, read_base_path

MEBIBYTE = 1024 * 1024
SHORTEST_TOKEN = 16


def _processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Settings(BaseSettings):
    """The configuration of a server, read at start and then frozen."""

    model_config = SettingsConfigDict(env_prefix="PFTRACK_", frozen=True, extra="forbid")

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    data_dir: Annotated[Path, AfterValidator(lambda path: path.expanduser().absolute())] = Field(
        Path("~/.local/share/pftrack"), description="Folder for uploads, runs and the database."
    )
    token: SecretStr | None = Field(None, description="Password of the link; made at start where one is needed.")
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field((), description="Further host names, comma-separated.")
    base_path: Annotated[str, AfterValidator(read_base_path)] = Field(
        "", description="Prefix of all addresses, such as /any/prefix."
    )
    trusted_proxies: Annotated[tuple[str, ...], NoDecode] = Field(
        (), description="Addresses and networks of trusted proxies (X-Forwarded headers), comma-separated."
    )

    filters: Annotated[tuple[Path, ...], NoDecode] = Field((), description="Filter files to execute, colon-separated.")

    max_sessions: int = Field(24, ge=1, le=1000, description="Sessions with a worker; an unwatched one gives way.")
    max_stored_sessions: int = Field(500, ge=1, description="Sessions kept; the oldest unnamed, unused one gives way.")
    max_branches: int = Field(24, ge=1, description="Branches of one session.")
    max_frames: int = Field(20_000, ge=2, description="Frames of one run.")
    max_pixels: int = Field(1920 * 1080 * 2, ge=1, description="Pixels of one frame of an upload.")
    max_particles: int = Field(100_000, ge=1, description="Particles of one tracker, over all its features.")
    max_upload_bytes: int = Field(512 * MEBIBYTE, ge=1, description="Bytes of one upload.")
    max_upload_files: int = Field(5_000, ge=1, description="Pictures of one upload.")
    max_uploads: int = Field(200, ge=1, description="Uploads kept.")
    max_uploads_bytes: int = Field(8192 * MEBIBYTE, ge=1, description="Bytes of all uploads together.")
    max_runs: int = Field(1_000, ge=1, description="Runs kept, those saved here and those imported.")
    max_comparisons: int = Field(1_000, ge=1, description="Comparisons kept.")
    max_runs_bytes: int = Field(2048 * MEBIBYTE, ge=1, description="Disk space of all saved runs together.")
    max_export_bytes: int = Field(1024 * MEBIBYTE, ge=1, description="Bytes of one file that a run is exported as.")
    max_record_bytes: int = Field(64 * MEBIBYTE, ge=1, description="Bytes of one imported run.")
    max_states_bytes: int = Field(1024 * MEBIBYTE, ge=0, description="Disk space of the checkpoints of all sessions.")
    reserve_bytes: int = Field(256 * MEBIBYTE, ge=0, description="Free disk space left to others.")
    max_body_bytes: int = Field(1 * MEBIBYTE, ge=1024, description="Bytes of one request that is not an upload.")

    worker_memory_bytes: int = Field(1024 * MEBIBYTE, ge=64 * MEBIBYTE, description="Memory of one worker of its own.")
    worker_cpu_seconds: int = Field(7200, ge=1, description="CPU time of one worker before its session is stopped.")
    start_seconds: float = Field(60.0, gt=0, description="Silence after which a worker that starts counts as hung.")
    hang_seconds: float = Field(15.0, gt=0, description="Silence after which a worker at work counts as hung.")
    idle_seconds: float = Field(900.0, gt=0, description="Time without visitors after which a session is suspended.")

    max_sweep_runs: int = Field(500_000, ge=1, description="Runs of one sweep.")
    max_sweeps_running: int = Field(2, ge=1, description="Sweeps computed at one time.")
    max_sweeps: int = Field(200, ge=1, description="Sweeps kept.")
    max_sweeps_bytes: int = Field(2048 * MEBIBYTE, ge=MEBIBYTE, description="Disk space of all sweeps together.")
    sweep_jobs: int = Field(default_factory=_processors, ge=1, le=256, description="Processes of one sweep.")

    @field_validator("allowed_hosts", "trusted_proxies", mode="before")
    @classmethod
    def _split_names(cls, value: object, info: ValidationInfo) -> object:
        """Read comma-separated names."""
        if not isinstance(value, str):
            return value
        if '"' in value:
            raise ValueError(f"{info.field_name} must be comma-separated names without quotes")
        return tuple(name.strip() for name in value.split(",") if name.strip())

    @field_validator("filters", mode="before")
    @classmethod
    def _split_paths(cls, value: object) -> object:
        """Read paths separated as in PATH."""
        return tuple(filter(None, value.split(os.pathsep))) if isinstance(value, str) else value

    @field_validator("trusted_proxies")
    @classmethod
    def _check_networks(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for proxy in value:
            try:
                ipaddress.ip_network(proxy)
            except ValueError:
                raise ValueError(f"a proxy is an address or network such as 10.0.0.0/8; got {proxy!r}") from None
        return value

    @model_validator(mode="after")
    def _safe(self) -> Self:
        if self.token is not None and len(self.token.get_secret_value()) < SHORTEST_TOKEN:
            raise ValueError(f"token must have at least {SHORTEST_TOKEN} characters")
        if self.token is None and (self.filters or not is_loopback(self.host)):
            # A server that others can reach, or that executes files written on a page, never runs without a token: even
            # on this machine there may be other users.
            object.__setattr__(self, "token", SecretStr(secrets.token_urlsafe(24)))
        if self.token is None:
            strangers = [name for name in self.allowed_hosts if not is_loopback(name)]
            if strangers:
                raise ValueError(
                    f"without a token allowed_hosts may only name this machine, not {', '.join(strangers)}; set "
                    f"PFTRACK_TOKEN, too, to at least {SHORTEST_TOKEN} characters"
                )
        return self

    @property
    def hosts(self) -> tuple[str, ...]:
        """Host names that a Host header may carry; `*` where the token alone protects the server."""
        if self.allowed_hosts:
            return ("localhost", "127.0.0.1", "::1", *self.allowed_hosts)
        return ("localhost", "127.0.0.1", "::1", self.host) if is_loopback(self.host) else ("*",)

    @property
    def edits_filters(self) -> bool:
        """Whether pages may write filter files: only if nobody but this machine, and no proxy, reaches the server."""
        return bool(self.filters) and is_loopback(self.host) and not (self.allowed_hosts or self.trusted_proxies)

    @property
    def database(self) -> str:
        """The SQLAlchemy URL of the database, a file in the data directory."""
        return f"sqlite:///{self.data_dir / 'pftrack.sqlite'}"

    def link(self, port: int) -> str:
        """Return the address to open in a browser, with the token if one is set."""
        everywhere = self.host in {"0.0.0.0", "::", ""}  # noqa: S104 - compared, not bound
        name = "localhost" if everywhere else f"[{self.host}]" if ":" in self.host else self.host
        query = f"?{urlencode({'token': self.token.get_secret_value()})}" if self.token else ""
        return f"http://{name}:{port}{encode_path(self.base_path)}/{query}"


def is_loopback(host: str) -> bool:
    """Return whether a host name reaches only this machine."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"
