"""The page of ``musync lab aeb``: collisions, and the speed of each impact by approach and weather."""

from collections.abc import Sequence
from typing import Any

from flows.pages.figures import Figure, Line, Panel, pick_style
from flows.pages.writer import Cell, Section, Table, write_page


def draw_page(result: dict[str, Any]) -> str:
    """Return the page: impact speed by approach and weather for each brake, and the summary.

    Parameters
    ----------
    result : of `studies.emergency_braking.compare.compare_brakes`
    """
    rows = result["rows"]
    weathers, brakes = (list(dict.fromkeys(row[key] for row in rows)) for key in ("weather", "brake"))
    sections = [
        Section(
            title="Collisions",
            parts=[
                Table(
                    rows=_tabulate_collisions(result["summary"], weathers),
                    note="Approaches that end in a collision, of all of the protocol, by weather.",
                )
            ],
        )
    ]
    if looks := [row for row in rows if "friction_seen" in row]:
        note = "Friction that `picture` reads when an approach begins, and that of the road."
        sections.append(
            Section(
                title="Read from the picture", parts=[Table(rows=_tabulate_looks(looks), note=note, digits=2)]
            )
        )
    for protocol, source in result["sources"].items():
        some = [row for row in rows if row["protocol"] == protocol]
        impacts = Table(
            rows=_tabulate_impacts(some, brakes),
            note="Speed over that of the target at the impact [km/h], red beyond what the rule allows; none is a dash.",
            digits=3,
        )
        sections.append(
            Section(title=protocol, parts=[source, *_plot_impacts(some, weathers, brakes), impacts])
        )
    return write_page(
        "musync lab aeb",
        "Emergency brakes by approach and weather",
        sections,
        lead=[
            f"{result['vehicle']} in coupled mode. Every brake knows where its target is, as far as the air lets it"
            " see. Blind brakes at a time to collision, friction at the way that the road asks for, picture at the way"
            " that the road seems to ask for, driver after a reaction."
        ],
    )


def _tabulate_collisions(summary: Sequence[dict[str, Any]], weathers: Sequence[str]) -> list[Any]:
    table: dict[tuple[str, str], dict[str, Any]] = {}
    for row in summary:
        line = table.setdefault(
            (row["protocol"], row["brake"]), {"protocol": row["protocol"], "brake": row["brake"]}
        )
        line[row["weather"]] = f"{row['collided']} of {row['approaches']}"
    return list(table.values())


def _tabulate_looks(rows: Sequence[dict[str, Any]]) -> list[Any]:
    lines: list[Any] = []
    for weather in dict.fromkeys(row["weather"] for row in rows):
        some = [row for row in rows if row["weather"] == weather]
        read = [row["friction_seen"] for row in some]
        lines.append(
            {
                "weather": weather, "road": some[0]["friction"],
                "read, mean": sum(read) / len(read), "least": min(read), "largest": max(read),
            }
        )  # fmt: skip
    return lines


def _tabulate_impacts(rows: Sequence[dict[str, Any]], brakes: Sequence[str]) -> list[Any]:
    table: list[Any] = []
    for brake in brakes:
        table.append(brake)
        lines: dict[str, dict[str, Any]] = {}
        for row in (row for row in rows if row["brake"] == brake):
            allowed, impact = row["allowed_km_h"], row["impact_speed_km_h"] or None
            bad = allowed is not None and row["impact_speed_km_h"] > allowed
            lines.setdefault(row["approach"], {"approach": row["approach"], "allowed": allowed})[
                row["weather"]
            ] = Cell(value=impact, tone="bad") if bad else impact
        table += lines.values()
    return table


def _plot_impacts(
    rows: Sequence[dict[str, Any]], weathers: Sequence[str], brakes: Sequence[str]
) -> list[Figure]:
    """Impact over approach speed with its band, a panel for each brake; none where all approaches have one speed."""
    if len({row["speed_km_h"] for row in rows}) < 2:
        return []
    panels = []
    for brake in brakes:
        lines = []
        for place, weather in enumerate(weathers):
            some = [row for row in rows if (row["brake"], row["weather"]) == (brake, weather)]
            band = {
                side: [row[end] for row in some]
                for side, end in (("low", "p05"), ("high", "p95"))
                if some and end in some[0]
            }
            lines.append(
                Line(
                    name=weather, x=[row["speed_km_h"] for row in some], y=[row["impact_speed_km_h"] for row in some],
                    style=pick_style(place), marked=True, **band,
                )
            )  # fmt: skip
        panels.append(Panel(title=brake, x="approach [km/h]", y="impact [km/h]", lines=lines, least=5.0))
    return [Figure(caption="Impact speed by approach and weather", panels=panels, columns=3)]
