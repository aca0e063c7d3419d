"""What every test of the command line has in common."""

import logging

import pytest


@pytest.fixture(autouse=True)
def quiet_about_compiling(caplog):
    """At the first use on a machine the log tells of it, on the standard error output."""
    caplog.set_level(logging.ERROR, logger="exudyn_muscles")
