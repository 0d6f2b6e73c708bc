"""Results on measured data, shortened to narrow tables for the terminal; the files hold every figure."""

from typing import Any


def shorten_import(result: dict[str, Any]) -> dict[str, Any]:
    """Return the report of an import, or a narrow table of signals for each recording."""
    if "signals" not in result:
        assumed = result["assumed_tolerances_1sigma"]
        told = ", ".join(f"{name} {sigma:g}" for name, sigma in assumed.items())
        runs = [run | {"start_s": _write_time(run["start_s"])} for run in result.get("runs", [])]
        listed = {"runs": runs} if runs else {}
        return result | listed | {"assumed_tolerances_1sigma": told or "none"}
    return {
        file: [_shorten_signal(row, any(row["note"] for row in rows)) for row in rows]
        for file, rows in result["signals"].items()
    }


def _shorten_signal(row: dict[str, Any], noted: bool) -> dict[str, Any]:
    start, low = row["start_s"], row["lowest"]
    return {
        **{key: row[key] for key in ("signal", "unit", "samples", "rate_hz")},
        "time_s": None if start is None else f"{_write_time(start)} to {_write_time(row['end_s'])}",
        "range": None if low is None else f"{low:.6g} to {row['highest']:.6g}",
        **({"note": row["note"]} if noted else {}),
    }


def _write_time(seconds: float) -> str:
    """Return a logger's time to the millisecond [s]; one that counts from 1970 has ten digits before the point."""
    return f"{round(seconds, 3) + 0.0:.3f}".rstrip("0").rstrip(".")  # -0.0004 is 0, and not -0


def shorten_agreement(result: dict[str, Any]) -> dict[str, Any]:
    """Return an agreement with the main columns of each case, and the groups."""
    hidden = {"window", "note"}
    cases = [{key: value for key, value in row.items() if key not in hidden} for row in result["cases"]]
    figures = tuple(result["mean"])
    groups = [
        {"split": row["split"], "by": row["by"], "group": row["name"], "cases": row["cases"]}
        | {name: _write_pair(row["mean"][name], row["maximum"][name]) for name in figures}
        for row in result["groups"]
    ]
    printed = [
        {"cases of": f"{row['split']}, {row['group']}", "figure": row["figure"],
         "here": _write_pair(row["mean"], row["maximum"]),
         "paper": _write_pair(row["paper_mean"], row["paper_maximum"]), "note": row["note"]}
        for row in result["beside_print"]
    ]  # fmt: skip
    return {"cases": cases, "mean / maximum of groups": groups, "beside the paper's against CarSim": printed}


def _write_pair(mean: float | None, maximum: float | None) -> str | None:
    """Mean and, where there is one, maximum in one cell, as the paper prints them."""
    if mean is None:
        return None
    return f"{mean:.4g}" if maximum is None else f"{mean:.4g} / {maximum:.4g}"


def shorten_verdict(result: dict[str, Any]) -> dict[str, Any]:
    """Return a verdict with a row for each parameter of a named effect, and for the error of each channel."""
    effects = [
        {
            "name": effect["name"],
            "class": effect["class"],
            "parameter": name,
            **{key: parameter[key] for key in ("value", "ci_low", "ci_high", "unit")},
        }
        for effect in result["effects"]
        for name, parameter in effect["parameters"].items()
    ]
    error = [
        {"channel": channel, **{key: entry[key] for key in ("frozen", "retuned", "after", "unit")}}
        for channel, entry in result["error"].items()
    ]
    kept = {key: result[key] for key in ("verdict", "sentence", "reasons", "vehicle_file", "report")}
    return kept | {"effects": effects, "error": error}
