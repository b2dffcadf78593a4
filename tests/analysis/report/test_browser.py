"""The report in a real browser: it draws, its controls answer, its console is clean, and it fetches nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from somatopy.analysis.report import write_report, write_study

pytestmark = pytest.mark.browser

UNDRAWN = "return document.querySelectorAll('.chart:not(:has(svg))').length"
MARKS = "return document.querySelectorAll('#{} {}').length"


@pytest.fixture(scope="module")
def page(rich_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of one run."""
    return write_report([rich_folder], tmp_path_factory.mktemp("pages") / "one.html")


@pytest.fixture(scope="module")
def opened(browser: Any, page: Path) -> Any:
    """The report of one run, opened."""
    return open_page(browser, page)


def open_page(browser: Any, page: Path) -> Any:
    for kind in ("browser", "performance"):
        browser.get_log(kind)
    browser.get(page.as_uri())
    return browser


def count(browser: Any, plot: str, marks: str) -> int:
    found: int = browser.execute_script(MARKS.format(f"plot-{plot}", marks))
    return found


def press(browser: Any, plot: str, control: str, index: int) -> None:
    """Click a control of a plot, again where the page was still moving as other plots were drawn."""
    from selenium.common.exceptions import ElementClickInterceptedException, StaleElementReferenceException
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait

    def pressed(driver: Any) -> bool:
        element = driver.find_element(By.ID, f"plot-{plot}").find_elements(By.CSS_SELECTOR, control)[index]
        driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", element)
        element.click()
        return True

    moving = (ElementClickInterceptedException, StaleElementReferenceException, IndexError)
    WebDriverWait(browser, 10, ignored_exceptions=moving).until(pressed)


def requests(browser: Any) -> set[str]:
    """Addresses that the page asked for, but for data that it carries itself; the browser's own pages aside."""
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    urls = {m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"}
    return {url for url in urls if not url.startswith(("data:", "blob:", "chrome:"))}


def test_every_plot_draws(opened: Any) -> None:
    """Lines, points, heat maps and units are really there."""
    assert count(opened, "hits", ".scatterlayer .trace") >= 4
    assert count(opened, "hits", ".scatterlayer .point") == 5 + 4
    assert count(opened, "efficiency", ".scatterlayer .trace") == 6
    for name in ("arm", "head", "gaze"):
        assert count(opened, name, ".scatterlayer .trace") >= 1
    assert count(opened, "misses", ".heatmaplayer image") == 2
    assert count(opened, "maps", ".scatterlayer .point") == 20 + 12
    empty = "return [...document.querySelectorAll('.chart')].filter((c) => !c.querySelector('svg')).map((c) => c.id)"
    assert opened.execute_script(empty) == []


def test_the_slider_changes_the_maps(opened: Any) -> None:
    """From the last window to the first, by keyboard: other links, and the text says when."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    units = "return document.querySelector('#plot-maps').data[3].x.length"
    colours = "return JSON.stringify(document.querySelector('#plot-maps').data.map((t) => t.marker && t.marker.color))"
    slider, when = (opened.find_element(By.ID, name) for name in ("maps-window", "maps-when"))
    assert when.text.startswith("after 45 min: ")
    linked, before = opened.execute_script(units), opened.execute_script(colours)
    assert f"from {linked} of 20 arm units" in when.text
    slider.send_keys(Keys.HOME)
    assert when.text.startswith("after 5 min: ")
    assert opened.execute_script(colours) != before
    slider.send_keys(Keys.ARROW_RIGHT)
    assert when.text.startswith("after 10 min: ")


def test_the_slider_changes_what_is_believed(opened: Any) -> None:
    """From the last moment to the first: other shading and marks, and outlines where the phase is another."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    drawn = "return [...document.querySelectorAll('#beliefs svg')].map((svg) => svg.innerHTML)"
    slider, when = (opened.find_element(By.ID, name) for name in ("beliefs-moment", "beliefs-when"))
    last = opened.execute_script(drawn)
    assert len(last) == 8 and when.text == "after 45 min, phase 2, damaged (offset)"
    slider.send_keys(Keys.HOME)
    first = opened.execute_script(drawn)
    assert when.text == "after 5 min, phase 1, intact" and all(a != b for a, b in zip(first, last, strict=True))
    slider.send_keys(Keys.END)
    assert opened.execute_script(drawn) == last


def test_maps_are_drawn_in_either_space(opened: Any) -> None:
    """The list offers the lattice and pairs of joints; choosing moves the units and brings angles to the axes."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import Select

    places = "const t = document.querySelector('#plot-maps').data; return JSON.stringify([t[4].x, t[4].y])"
    choice = Select(opened.find_element(By.ID, "maps-view"))
    joints = ["lattice space", "joint space: ShoulderPitch, ShoulderRoll", "joint space: ElbowYaw, ElbowRoll"]
    assert [option.text for option in choice.options] == joints
    choice.select_by_index(0)
    lattice = opened.execute_script(places)
    choice.select_by_index(2)
    assert opened.execute_script(places) != lattice
    assert "°" in opened.find_element(By.ID, "plot-maps").text
    assert "ElbowYaw (across)" in opened.find_element(By.ID, "plot-maps").text


def test_legends_hide_and_show(opened: Any) -> None:
    """A click on a name takes its line away."""
    from selenium.webdriver.support.ui import WebDriverWait

    press(opened, "efficiency", ".legendtoggle", 0)
    WebDriverWait(opened, 5).until(lambda driver: count(driver, "efficiency", ".scatterlayer .trace") == 5)


def test_the_list_of_joints_changes_the_misses(opened: Any) -> None:
    """Another pair: other axes, still two heat maps."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait

    plot = opened.find_element(By.ID, "plot-misses")
    assert "ElbowRoll (°)" not in plot.text
    press(opened, "misses", ".updatemenu-header", 0)
    press(opened, "misses", ".updatemenu-dropdown-button", -1)
    WebDriverWait(opened, 5).until(lambda _: "ElbowRoll (°)" in plot.text and "ElbowYaw (°)" in plot.text)
    assert count(opened, "misses", ".heatmaplayer image") == 2


def test_a_narrow_window_is_not_wider_than_itself(browser: Any, page: Path) -> None:
    """On a telephone's width nothing sticks out; plots follow."""
    browser.set_window_size(500, 900)
    open_page(browser, page)
    inside, width = browser.execute_script("return [document.documentElement.scrollWidth, innerWidth]")
    assert inside <= width
    assert browser.execute_script("return document.querySelector('#plot-hits .main-svg').clientWidth") <= width
    browser.set_window_size(1300, 1000)


#: Words of plots, and of the headings above them, that a button of the plot's toolbar stands on.
UNDER_BUTTONS = """
const box = (part) => part.getBoundingClientRect();
const over = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
return [...document.querySelectorAll('.js-plotly-plot')].flatMap((chart) => {
  const buttons = [...chart.querySelectorAll('.modebar-btn')].map(box);
  const heading = document.createRange();
  heading.selectNodeContents(document.getElementById(chart.getAttribute('aria-labelledby')));
  const words = [...chart.querySelectorAll('svg text')].map((text) => [text.textContent, [box(text)]]);
  return [...words, [heading.toString(), [...heading.getClientRects()]]]
    .filter(([, boxes]) => !buttons.length || boxes.some((word) => buttons.some((button) => over(word, button))))
    .map(([text]) => [chart.id, text]);
});
"""


@pytest.mark.parametrize("width", [800, 500])
def test_the_toolbar_of_a_plot_stands_on_no_words(browser: Any, page: Path, width: int) -> None:
    """Neither on the legend nor on the heading; every plot has buttons."""
    browser.set_window_size(width, 1000)
    open_page(browser, page)
    assert browser.execute_script(UNDER_BUTTONS) == []
    browser.set_window_size(1300, 1000)


def test_nothing_is_fetched_and_nothing_complained_of(
    browser: Any, page: Path, rich_folder: Path, rich_copy: Any, tmp_path: Path
) -> None:
    """The page alone is asked for, its console stays empty; also where several runs are compared."""
    several = write_report([rich_folder, rich_copy.path], tmp_path / "several.html")
    for file in (page, several):
        open_page(browser, file)
        assert count(browser, "hits", ".scatterlayer .trace") >= 2
        assert requests(browser) == {file.as_uri()}
        assert browser.get_log("browser") == []
        assert browser.execute_script("return document.querySelectorAll('[data-title*=\"hare chart\"]').length") == 0


def test_what_it_would_fetch_is_refused(opened: Any) -> None:
    """The page's own policy keeps a script from reaching out."""
    asked = opened.execute_async_script(
        "const done = arguments[arguments.length - 1];"
        "fetch('data:text/plain,x').then(() => done('allowed'), () => done('refused'))"
    )
    assert asked == "refused"
    opened.get_log("browser")


# -- studies -----------------------------------------------------------------------------------------------------------

#: Everything that is wider than its place: the page, tables, and words of plots that leave their plot.
CLIPPED = """
const wide = [...document.querySelectorAll('.wide, .panels, figure')].filter((e) => e.scrollWidth > e.clientWidth);
const words = [...document.querySelectorAll('.chart')].flatMap((chart) => {
  const box = chart.getBoundingClientRect();
  return [...chart.querySelectorAll('svg text')].filter((text) => {
    const r = text.getBoundingClientRect();
    const across = r.left < box.left - 1 || r.right > box.right + 1;
    const down = r.top < box.top - 1 || r.bottom > box.bottom + 1;
    return r.width && (across || down);
  });
});
const page = document.documentElement.scrollWidth > innerWidth ? ['page'] : [];
return [...page, ...[...wide, ...words].map((e) => e.textContent.slice(0, 80))];
"""
#: Pairs of words of one plot that stand on each other.
OVERPRINTED = """
return [...document.querySelectorAll('.chart')].flatMap((chart) => {
  const texts = [...chart.querySelectorAll('svg text')].map((t) => [t.textContent, t.getBoundingClientRect()]);
  const shown = texts.filter(([, r]) => r.width > 0);
  const over = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 2 && b.top < a.bottom - 2;
  return shown.flatMap(([name, a], k) => shown.slice(k + 1).filter(([, b]) => over(a, b)).map(([n]) => [name, n]));
});
"""


@pytest.fixture(scope="module")
def study_pages(studies: Any) -> dict[str, Path]:
    """The reports of a study with few conditions and of one with many."""
    return {name: write_study(study) for name, study in studies.items()}


@pytest.mark.parametrize("name", ["few", "many"])
@pytest.mark.parametrize("width", [1280, 800])
def test_nothing_of_a_study_is_clipped_or_overprinted(
    browser: Any, study_pages: dict[str, Path], name: str, width: int
) -> None:
    """Tables fit, and words of plots stand inside of them and apart; all details opened."""
    browser.set_window_size(width, 1000)
    open_page(browser, study_pages[name])
    browser.execute_script("document.querySelectorAll('.differences').forEach((d) => { d.open = true; })")
    assert browser.execute_script(CLIPPED) == []
    assert browser.execute_script(OVERPRINTED) == []
    browser.set_window_size(1300, 1000)


def test_a_study_is_drawn_and_tabled(browser: Any, studies: Any, study_pages: dict[str, Path]) -> None:
    """Lines, bands and dots of all seeds; a row for each condition and phase; nothing is fetched or complained of."""
    from selenium.webdriver.support.ui import WebDriverWait

    for name, conditions in (("few", 3), ("many", 20)):
        open_page(browser, study_pages[name])
        rows = "return document.querySelectorAll('{} tbody tr').length"
        assert browser.execute_script(rows.format("#means .means")) == 2 * conditions
        assert browser.execute_script(rows.format("#differences details:first-of-type")) == 2 * (conditions - 1)
        marks, folded = 2 * (5 + 1) + 1, max(0, conditions - 12)
        assert count(browser, "rates", ".scatterlayer .point") == min(12, conditions) * marks
        assert browser.execute_script(UNDRAWN) == folded + (folded > 0)  # each condition's hits, and the rates of all
        browser.execute_script("document.querySelectorAll('.more').forEach((d) => { d.open = true; })")
        WebDriverWait(browser, 10).until(lambda driver: driver.execute_script(UNDRAWN) == 0)
        assert count(browser, "rates-more", ".scatterlayer .point") == folded * marks
        assert requests(browser) == {study_pages[name].as_uri()}
        assert browser.get_log("browser") == []
    assert count(browser, "hits-7", ".scatterlayer .point") == 5 * 4
    open_page(browser, study_pages["few"])
    assert count(browser, "hits", ".scatterlayer .point") == 3 * 5 * 4
    assert count(browser, "hits", ".scatterlayer .js-fill") == 3


@pytest.mark.parametrize("key", ["csv", "tex"])
def test_tables_are_copied_and_saved(browser: Any, study_pages: dict[str, Path], key: str, tmp_path: Path) -> None:
    """The button puts the text into the clipboard, the link saves a file: both as it stands beside the page."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait

    page = study_pages["few"]
    expected = page.with_name(f"table.{key}").read_text(encoding="utf-8")
    open_page(browser, page)
    browser.execute_cdp_cmd("Browser.grantPermissions", {"permissions": ["clipboardReadWrite"]})
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    box = browser.find_element(By.ID, f"copy-{key}")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", box)
    box.find_element(By.TAG_NAME, "button").click()
    WebDriverWait(browser, 5).until(lambda _: box.find_element(By.TAG_NAME, "output").text == "copied")
    read = "const done = arguments[0]; navigator.clipboard.readText().then(done, (error) => done(String(error)))"
    assert browser.execute_async_script(read) == expected
    box.find_element(By.TAG_NAME, "a").click()
    saved = tmp_path / f"table.{key}"
    WebDriverWait(browser, 10).until(lambda _: saved.is_file())
    assert saved.read_text(encoding="utf-8") == expected
    assert browser.get_log("browser") == []


def test_groups_of_runs_have_their_table(browser: Any, rich_folder: Path, rich_copy: Any, tmp_path: Path) -> None:
    """The page of several runs: a row for each phase of each group, and both tables to copy."""
    open_page(browser, write_report([rich_folder, rich_copy.path], tmp_path / "several.html"))
    assert browser.execute_script("return document.querySelectorAll('#means .means tbody tr').length") == 2 * 2
    texts = browser.execute_script("return [...document.querySelectorAll('#means textarea')].map((t) => t.value)")
    assert texts[0].startswith("condition,phase,state,measure") and "\\begin{tabular}" in texts[1]
    browser.execute_script("document.querySelectorAll('.claim, .untold').forEach((d) => { d.open = true; })")
    assert browser.execute_script(CLIPPED) == []
    assert browser.execute_script(OVERPRINTED) == []
