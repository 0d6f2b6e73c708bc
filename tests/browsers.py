"""An installed Chromium for tests of pages, and axe-core, which finds what keeps people from using a page."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@contextmanager
def open_chromium() -> Iterator["Browser"]:
    """Yield a browser; skips the test where playwright or a Chromium is missing."""
    api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install playwright"
    )
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        pytest.skip("no Chromium on the path: install one to test pages in it")
    with api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield browser
        browser.close()


def find_barriers(browser: "Browser", page: Path, ready: str = "body") -> list[str]:
    """Return axe-core's violations on a page in light and in dark, each with its rule and elements.

    Parameters
    ----------
    browser : from `open_chromium`
    page : file
    ready : selector of what is there when the page's scripts are done
    """
    pytest.importorskip(
        "axe_playwright_python", reason="axe-core is not installed: pip install axe-playwright-python"
    )
    axe = files("axe_playwright_python").joinpath("axe.min.js").read_text()
    barriers = []
    for scheme in ("light", "dark"):
        context = browser.new_context(
            viewport={"width": 1280, "height": 900}, color_scheme=scheme, bypass_csp=True
        )
        tab = context.new_page()
        tab.goto(page.as_uri())
        tab.wait_for_selector(ready)
        tab.evaluate(axe)
        found = tab.evaluate("axe.run({ resultTypes: ['violations'] })")["violations"]
        barriers += [f"{scheme} {v['id']}: {[node['target'] for node in v['nodes']]}" for v in found]
        context.close()
    return barriers
