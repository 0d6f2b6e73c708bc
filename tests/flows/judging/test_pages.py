"""Pages and figures that we write: text of users and datasets is text in them."""

from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

from flows.judging.evaluation_page import render_page
from flows.judging.evaluation_rows import figure_row
from flows.judging.motion_curves import PITCH, MotionPanel
from flows.pages import make_policy

HOSTILE = [
    '<img src=x onerror="alert(1)">', "</title></style><script>alert(1)</script>", "\"'><svg onload=alert(1)>",
    "<a href=javascript:alert(1)>", r"$\frac$", r"\$x$", "&lt;b&gt;",
]  # fmt: skip


class Elements(HTMLParser):
    """Tags, attributes and text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attributes

    def handle_data(self, text: str) -> None:
        self.text.append(text)


def assert_text_alone(html: str, hostile: str) -> Elements:
    found = Elements(html)
    assert not {"script", "iframe", "object", "a", "form"} & set(found.tags)
    assert not [name for name, _ in found.attributes if name.startswith("on")]
    assert not [
        value for name, value in found.attributes if name == "src" and not (value or "").startswith("data:")
    ]
    assert f'content="{make_policy()}"' in html
    assert any(hostile in text for text in found.text)
    return found


def test_a_policy_runs_the_pages_own_scripts_and_fetches_nothing():
    own = "'sha256-5KYv+PUboo5h+0+YAtGRPbwv5d/QxzHslP4YGnUaxRw='"  # openssl dgst -sha256 -binary | base64
    closed = {"default-src 'none'", "base-uri 'none'", "form-action 'none'", "img-src data:"}
    assert set(make_policy().split("; ")) == closed | {"style-src 'unsafe-inline'"}
    assert f"style-src {own}" in make_policy(style="go()").split("; ")
    assert set(make_policy(scripts=["go()"]).split("; ")) >= {f"script-src {own}", "default-src 'none'"}


@pytest.mark.parametrize("hostile", HOSTILE)
def test_the_evaluation_takes_labels_as_text(hostile):
    times = np.linspace(0, 1, 5)
    motion = SimpleNamespace(pitch=np.zeros(5))
    clip = SimpleNamespace(
        facts={"label": hostile}, frames={"pitch": np.zeros(5)}, times=times, motions={hostile: motion},
        thumbnails=[np.zeros((4, 6, 3), np.uint8)],
    )  # fmt: skip
    rows = [
        figure_row("pitch_rmse", hostile, hostile, 1.0, "deg", note=hostile),
        figure_row("e_geometry_hump", hostile, hostile, 1.0, "1", floor=0.5, note=hostile),
    ]
    panel = MotionPanel(
        title=hostile, quantity=PITCH, times=times, meant=np.zeros(5), recovered={hostile: np.zeros((2, 5))}
    )
    found = assert_text_alone(render_page([clip], rows, {hostile: [panel]}, hostile, hostile), hostile)
    assert sum(text == hostile for text in found.text) > 5
