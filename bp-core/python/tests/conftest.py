"""Programs and folders that the tests share."""

from pathlib import Path

import pytest

import bayesian_programs as bp

ROOT = Path(__file__).resolve().parents[3]
DOOR = ROOT / "examples" / "door"


@pytest.fixture(scope="session")
def grass():
    return bp.open(DOOR / "grass.bp")


@pytest.fixture(scope="session")
def door():
    return bp.open(DOOR / "door.bp")


@pytest.fixture(scope="session")
def alarm():
    return bp.read(DOOR / "alarm.bif")


@pytest.fixture(scope="session")
def line():
    """Y is X with noise: posterior of X given Y = 2 is normal(1, √½)."""
    return bp.program(
        """program Line {
            variables { X, Y : real; }
            decomposition { P(X) P(Y | X) }
            forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); }
        }"""
    )
