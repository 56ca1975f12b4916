"""The page about surfaces, as a browser shows it."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import surface_scenes
from surface_points import UTM, Array

import surfsig
from surfsig import PointCloud

pytest.importorskip("plotly")


def drawn(page: Path) -> str:
    """Let a browser without a window run the page, and return what it has become."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    browser = next(filter(None, map(shutil.which, names)), None)
    if browser is None:
        pytest.skip("no Chromium")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"]
    options += ["--virtual-time-budget=10000", f"--user-data-dir={page.parent / 'profile'}", "--dump-dom"]
    done = subprocess.run([browser, *options, page.as_uri()], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("origin", [np.zeros(3), UTM])
def test_a_browser_draws_the_page(tmp_path: Path, origin: Array) -> None:
    found = surfsig.find_surfaces(PointCloud(surface_scenes.on_a_plane().points, origin))
    page = tmp_path / "report.html"
    found.write_report(page, title="a < b & c")
    text = drawn(page)
    assert "<title>a &lt; b &amp; c</title>" in text
    # Plotly has put a scene and its canvas into the view, and one line for each surface into the legend.
    assert re.search(r'<div class="gl-container">.*?<canvas', text, re.DOTALL)
    assert re.findall(r'class="legendtext"[^>]*>([^<]+)<', text) == [
        "0 plane",
        "1 cylinder",
        "2 sphere",
        "no surface",
    ]
    (body,) = re.findall(r"<tbody>(.*)</tbody>", text, re.DOTALL)
    rows = re.findall(r"<tr>(.*?)</tr>", body)
    assert len(rows) == len(found) == 3
    for row, words in zip(rows, found.table()[1], strict=True):
        assert re.findall(r"<td[^>]*>([^<]*)</td>", row) == list(words[1:])


def test_the_page_needs_no_network_and_draws_some_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(13)
    flat = np.column_stack([rng.uniform(0, 1, (150_000, 2)), 0.001 * rng.normal(size=150_000)])
    found = surfsig.find_surfaces(flat[:100_000])
    found.write_report(tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="', text)
    # The library, and 50,000 of the points twice, with three float32 each and once a deviation, in base64.
    assert 50_000 * 37 < len(text) - 4_000_000 < 60_000 * 37 + 1_500_000


def test_a_page_without_surfaces(tmp_path: Path) -> None:
    surfsig.find_surfaces(np.full((9, 3), np.nan)).write_report(tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "no surface found: of 9 points none is finite" in text


@pytest.mark.parametrize(
    "click", ["rows[1].click()", "view.emit('plotly_click', {points: [{data: {meta: 1}}]})"]
)
def test_a_click_marks_the_surface(tmp_path: Path, click: str) -> None:
    page = tmp_path / "report.html"
    surfsig.find_surfaces(surface_scenes.on_a_plane().points).write_report(page)
    script = (
        "const places = () => view.data.map(trace => trace.marker.size).join(' ');"
        f"setTimeout(() => {{ {click}; document.title = places(); }}, 2000);"
    )
    text = page.read_text(encoding="utf-8")
    marked = text.replace(
        "rows.forEach((row, i) => row.addEventListener",
        f"{script}\nrows.forEach((row, i) => row.addEventListener",
    )
    assert marked != text
    page.write_text(marked, encoding="utf-8")
    shown = drawn(page)
    assert "<title>1.6 1.6 4 1.6 1.6</title>" in shown
    assert re.findall(r'<tr class="chosen">.*?<td[^>]*>(\w+)</td>', shown) == ["cylinder"]
