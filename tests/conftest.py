"""Hypothesis without a clock; Chromium; the markers `gl`, `osmesa`, `browser`, `cluster`, `robots`: no silent skips."""

from __future__ import annotations

import ctypes
import gc
import importlib.util
import os
import shutil
import subprocess
from collections.abc import Generator
from functools import cache
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("somatopy", deadline=None, derandomize=True)
settings.load_profile("somatopy")

#: Why tests of each marker are skipped, where they are.
REASONS = {
    "gl": "needs OpenGL",
    "osmesa": "needs OSMesa",
    "browser": "needs Chromium",
    "cluster": "needs Ray nodes",
    "robots": "needs packages with robots",
}

#: How Chromium is started: without a window, and without anything that it would fetch by itself.
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--window-size=1300,1000",
)

#: A command in a network of its own, where only the loopback is. Who is not root is so in a user namespace only.
NAMESPACE = ("unshare", "--net") if os.geteuid() == 0 else ("unshare", "--map-root-user", "--net")


@cache
def why_no_gl() -> str | None:
    """Why no OpenGL context can be made, or None if one can."""
    from somatopy.bodies.rendering import NoGL, gl_backend

    try:
        gl_backend()
    except NoGL as error:
        return str(error)
    return None


@cache
def why_no_osmesa() -> str | None:
    """Why OSMesa cannot draw, or None if it can. Newer systems have only EGL, so that no machine need have it."""
    try:
        ctypes.CDLL("libOSMesa.so.8")
    except OSError as error:
        return f"The fallback OSMesa is not installed ({error}); on Debian 12: apt-get install libosmesa6."
    return None


@cache
def why_no_browser() -> str | None:
    """Why no page can be opened, or None if one can."""
    missing = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    if not missing:
        return None
    return f"Not installed: {', '.join(missing)}; on Debian: apt-get install chromium chromium-driver."


@cache
def why_no_namespace() -> str | None:
    """Why there can be no network of its own for two Ray nodes, or None if there can."""
    try:
        done = subprocess.run([*NAMESPACE, "true"], capture_output=True, text=True, check=False)
    except OSError as error:
        return f"unshare cannot be called ({error}); on Debian: apt-get install util-linux."
    return f"{' '.join(NAMESPACE)} is not allowed here: {done.stderr.strip()}." if done.returncode else None


@cache
def why_no_cluster() -> str | None:
    """Why no Ray nodes can be started, or None if they can."""
    if importlib.util.find_spec("ray") is None:
        return 'Ray is not installed: pip install "somatopy[cluster]".'
    return why_no_namespace()


@cache
def why_no_robots() -> str | None:
    """Why the robots of examples/robots cannot be built, or None if they can."""
    packages = ("dm_control", "gymnasium_robotics", "gym_aloha")
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    install = 'pip install "somatopy[robots]", and then pip install --no-deps gym-aloha'
    return f"Not installed: {', '.join(missing)}; {install}." if missing else None


@pytest.fixture(autouse=True, scope="session")
def cache_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Generator[None, None, None]:
    """No test writes to the user's cache folder, or reads what is there."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Generator[Any, None, None]:
    """Chromium without a window, with a profile of its own, that keeps a log of its console and of requests."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def pytest_collection_finish() -> None:
    """What has been collected stays until the end: the garbage collector need not look through it again and again."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("gl") is not None and why_no_gl() is not None:
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI=true allows no skip. {why_no_gl()}", pytrace=False)
        pytest.skip(REASONS["gl"])
    if item.get_closest_marker("browser") is not None and why_no_browser() is not None:
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI=true allows no skip. {why_no_browser()}", pytrace=False)
        pytest.skip(REASONS["browser"])
    if item.get_closest_marker("cluster") is not None and why_no_cluster() is not None:
        if os.environ.get("CI") == "true" and why_no_namespace() is None:
            pytest.fail(f"CI=true allows no skip. {why_no_cluster()}", pytrace=False)
        pytest.skip(REASONS["cluster"])
    if item.get_closest_marker("robots") is not None and why_no_robots() is not None:
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI=true allows no skip. {why_no_robots()}", pytrace=False)
        pytest.skip(REASONS["robots"])
    if item.get_closest_marker("osmesa") is not None and why_no_osmesa() is not None:
        pytest.skip(REASONS["osmesa"])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Generator[None, None, None]:
    """The tests that did not run are counted last, under everything else, also where several processes run them."""
    yield
    skipped = [str(report.longrepr) for report in terminalreporter.stats.get("skipped", [])]
    missing = {marker: sum(reason in said for said in skipped) for marker, reason in REASONS.items()}
    if any(missing.values()):
        terminalreporter.section("TESTS THAT DID NOT RUN", red=True, bold=True)
    reasons = {
        "gl": why_no_gl,
        "osmesa": why_no_osmesa,
        "browser": why_no_browser,
        "cluster": why_no_cluster,
        "robots": why_no_robots,
    }
    for marker, why in reasons.items():
        if missing[marker]:
            terminalreporter.line(f"{missing[marker]} tests did not run. {why()}", red=True)
