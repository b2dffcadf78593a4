"""Hypothesis without a clock, and the `gl` marker: tests that render are never skipped in silence."""

from __future__ import annotations

import os
from collections.abc import Generator
from functools import cache

import pytest
from hypothesis import settings

settings.register_profile("somatopy", deadline=None, derandomize=True)
settings.load_profile("somatopy")

not_run: list[str] = []


@cache
def why_no_gl() -> str | None:
    """Why no OpenGL context can be made, or None if one can."""
    from somatopy.bodies.rendering import NoGL, gl_backend

    try:
        gl_backend()
    except NoGL as error:
        return str(error)
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("gl") is None or why_no_gl() is None:
        return
    if os.environ.get("CI") == "true":
        pytest.fail(f"CI=true allows no skip. {why_no_gl()}", pytrace=False)
    not_run.append(item.nodeid)
    pytest.skip("needs OpenGL")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Generator[None, None, None]:
    """The tests that did not run are named last, under everything else."""
    yield
    if not_run:
        terminalreporter.section("TESTS THAT DID NOT RUN", red=True, bold=True)
        terminalreporter.line(f"{len(not_run)} tests draw with OpenGL and did not run. {why_no_gl()}", red=True)
