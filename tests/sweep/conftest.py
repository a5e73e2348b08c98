"""A small plan, its finished sweep and the report of that, which many tests look at."""

import pytest

from pftrack.sweep import Plan, Result, carry_out
from pftrack.sweep.axis import Axis
from pftrack.sweep.report.files import Report, write_report
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

WIDTHS = (0.0, 20.0, 40.0, 60.0)
RADII = (1.0, 10.0)


@pytest.fixture(scope="session")
def plan() -> Plan:
    return Plan(
        "ball",
        (Axis("occlusion_width_px", WIDTHS), Axis("distracter_radius_px", RADII)),
        ("h-spf", "condensation"),
        trials=6,
        seed=3,
        frames=20,
        values={"sample_count": 50},
    )


@pytest.fixture(scope="session")
def finished(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Result:
    return carry_out(plan, tmp_path_factory.mktemp("sweep") / "small.parquet", jobs=1)


@pytest.fixture(scope="session")
def report(finished: Result, tmp_path_factory: pytest.TempPathFactory) -> Report:
    return write_report(finished, tmp_path_factory.mktemp("report") / "made", level=0.2)
