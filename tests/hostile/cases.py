"""What the fuzzer found, kept: each is a change of a sound document that its loader must refuse in a sentence.

`TEXTS` take a whole file's place. `PLACES` put a value into a tree, `WORDS` replace bytes, `COLUMNS` replace a column
of Parquet; each names the parser of `benchmarks.fuzzing.parsers` and the file of its sound document.
"""

import pyarrow as pa

from benchmarks.fuzzing.rules import INF, NAN
from benchmarks.fuzzing.trees import BOMB, Raw

DEEP = b"[" * 100_000
TEXTS: dict[str, bytes] = {
    "nothing": b"",
    "no UTF-8": "é: 1".encode("latin-1"),
    "control characters": b"a: \x00\x07",
    "brackets without end": DEEP,
    "tables without end": b'{"a":' * 5_000 + b"1" + b"}" * 5_000,
    "a bomb of aliases": BOMB.encode(),
    "a value that holds itself": b"&a [*a]",
    "an object of Python": b"{a: !!python/object/apply:os.getcwd []}",
    "an unknown tag": b"{a: !unknown 7}",
    "a number of 5,000 digits": b'{"a": ' + b"1" * 5_000 + b"}",
    "a date that is none": b"{a: 9999-99-99}",
    "an unhashable key": b"{? [a, b] : 1}",
    "a list": b"[1, 2]",
    "a number": b"7",
    "a key twice": b'{"a": 1, "a": 2}',
    "no number": b'{"a": NaN}',
    "half a character": b'{"a": "\\ud800"}',
    "an unclosed table": b'{"a": 1',
    "a time": b"{a: 12:30:45, b: 2026-01-01}",
    "an equals sign": b"{a: =}",
}
"""Documents that no reader of YAML or JSON takes."""

PLACES: tuple[tuple[str, str, tuple, object], ...] = (
    ("bump study", "comma2k19/entry.yaml", ("windows", 0, "from_s"), INF),
    ("bus", "a2d2-like/entry.yaml", ("signals", 0, "unit"), "furlong"),
    ("calibration procedure", "paper-staged/entry.yaml", ("passes", "unit"), "furlong"),
    ("camera", "dashcam-480x320/entry.yaml", ("name",), Raw(BOMB)),
    ("camera", "dashcam-480x320/entry.yaml", ("width", "value"), 10**400),
    ("campaign", "0/campaign.yaml", ("split",), None),
    ("campaign", "0/campaign.yaml", ("split", "train"), [["a"]]),
    ("campaign", "0/campaign.yaml", ("split", "train", 0), {"a": 1}),
    ("campaign", "0/campaign.yaml", ("tolerances_1sigma",), []),
    ("campaign", "0/campaign.yaml", ("tolerances_1sigma", "run"), 7),
    ("campaign", "0/campaign.yaml", ("tolerances_1sigma", "mass"), NAN),
    ("campaign", "0/campaign.yaml", ("sample_rate_hz",), INF),
    ("drives", "0/campaign.yaml", ("sample_rate_hz",), NAN),
    ("drives", "0/campaign.yaml", ("campaign",), ["x" * 100_000]),
    ("effects library", "library/entry.yaml", (0,), 7),
    ("effects library", "library/entry.yaml", (0, "name"), ["a"]),
    ("effects library", "library/entry.yaml", (0, "parameters"), 7),
    ("effects library", "library/entry.yaml", (0, "parameters", 0), {}),
    ("frozen inputs", "0/inputs/vehicle.yaml", ("sprung_mass",), 7),
    ("frozen run", "demo/run.json", ("clips",), NAN),
    ("frozen run", "demo/run.json", ("clips", 0, "seed"), 2**70),
    ("frozen run", "demo/run.json", ("grid",), "\ud800"),
    ("grid", "demo/grid.yaml", ("axes", "weather"), {None: None, "no_such_key": 7}),
    ("grid", "demo/grid.yaml", ("axes", "weather"), {1: 2}),
    ("grid", "demo/grid.yaml", ("axes",), {None: 7}),
    ("grid", "demo/grid.yaml", ("frames",), 2**31),
    ("grid", "demo/grid.yaml", ("name",), "x" * 100_000),
    ("grid", "ways/grid.yaml", ("base", "precipitation_mm_h"), 50_000),
    ("grid", "ways/grid.yaml", ("base", "peak_pressure_mpa"), 23),
    ("grid", "ways/grid.yaml", ("zip", "speed", "fast", "initial_speed_km_h"), 1e308),
    ("grid", "ways/grid.yaml", ("latin_hypercube", "ranges", "precipitation_mm_h"), [1, 1e308]),
    ("hazard marking", "zebra-yellow-black/entry.yaml", ("stripe_width", "value"), NAN),
    ("manifest alone", "0/manifest.json", ("clips",), 7),
    ("manifest alone", "0/manifest.json", ("clips", 0), []),
    ("manifest alone", "0/manifest.json", ("clips", 0, "clip_id"), "../../etc"),
    ("manifest alone", "0/manifest.json", ("clips", 0, "figures"), None),
    ("manifest alone", "0/manifest.json", ("clips", 0, "verdict"), {}),
    ("manifest alone", "0/manifest.json", ("clips", 0, "artifacts"), {"../../.bashrc": "0" * 64}),
    ("manifest alone", "0/manifest.json", ("inputs",), {"../../.bashrc": "0" * 64}),
    ("manifest alone", "0/manifest.json", ("artifacts",), {"/etc/passwd": "0" * 64}),
    ("manifest alone", "0/manifest.json", ("artifacts",), {"plan.json": "no hash"}),
    ("manifest alone", "0/manifest.json", ("grid",), []),
    ("manifest alone", "0/manifest.json", ("run_id",), "0123456789abcdef\n"),
    ("plan", "0/plan.json", ("grid", "frames"), "x"),
    ("plan", "0/plan.json", ("grid",), None),
    ("plan", "0/plan.json", ("clips", 0), 7),
    ("plan", "0/plan.json", ("clips", 0, "scenario"), {}),
    ("plan", "0/plan.json", ("clips", 0, "scenario", "weather"), {"a": 1}),
    ("plan", "0/plan.json", ("clips", 0, "clip_id"), "/etc/passwd"),
    ("plan", "0/plan.json", ("inputs",), {"../x": "0" * 64}),
    ("recording", "json/log.json", ("speed", "values", 0), [1, 2, 3]),
    ("recording", "json/log.json", ("speed", "values", 0), [[1, 2], [3, 4]]),
    ("recording", "json/log.json", ("speed", "values"), 7),
    ("recording", "json/log.json", ("speed", "unit"), ["m/s"]),
    ("recording", "json/log.json", ("speed",), ["m/s"]),
    ("reference", "0/cases.json", (0, "case"), "*"),
    ("reference", "0/cases.json", (0, "case"), "../a"),
    ("reference", "0/cases.json", (0, "case"), "/etc/passwd"),
    ("reference", "0/cases.json", (0, "case"), "b"),
    ("reference", "0/cases.json", (0, "initial_speed_km_h"), 1e308),
    ("reference", "0/cases.json", (0, "initial_speed_km_h"), "40"),
    ("reference", "0/cases.json", (0, "peak_pressure_mpa"), 300),
    ("reference", "0/cases.json", (0,), 7),
    ("route", "nerfstudio/route.json", ("frames", 0, "transform_matrix"), [[0.0] * 4] * 4),
    ("route", "nerfstudio/route.json", ("frames", 0, "transform_matrix", 3), [0, 0, 0, 0]),
    ("route", "nerfstudio/route.json", ("frames", 0, "transform_matrix", 0, 0), 1e300),
    ("scene folder", "0/scene.json", ("sha256", "means.npy"), 7),
    ("scene folder", "0/scene.json", ("carriageway_left",), INF),
    ("scene folder", "0/scene.json", ("carriageway_left",), 1e300),
    ("stop study", "bmw-m8/entry.yaml", ("lead_s", "unit"), ""),
    ("truths", "truths/entry.yaml", ("library",), 7),
    ("truths", "truths/entry.yaml", ("outside",), [7]),
    ("truths", "truths/entry.yaml", ("sizes",), {"a": None}),
    ("vehicle", "paper-reference/entry.yaml", ("sprung_mass",), Raw("2026-01-01")),
    ("video's camera", "0/camera.yaml", ("width",), INF),
    ("video's camera", "0/camera.yaml", ("width",), 0.5),
    ("video's camera", "0/camera.yaml", ("height",), True),
    ("video's camera", "1/camera.yaml", ("height_above_road",), "high"),
    ("video's camera", "1/camera.yaml", ("k1",), INF),
)
"""(parser, document/file, place, value)."""

WORDS: tuple[tuple[str, str, bytes, bytes], ...] = (
    ("campaign", "0/runs.csv", b"run-0,", b"../run-0,"),
    ("campaign", "0/runs.csv", b"run-0,dry", "run-é,dry".encode("latin-1")),
    ("campaign", "0/runs.csv", b"20.0", b"nan"),
    ("drives", "0/runs.csv", b"run-0,dry,0.0", b"run-0,dry,inf"),
    ("drives", "0/runs.csv", b"run-0,dry", b"run-0,hail"),
    ("Gaussians", "compressed.ply/cloud.compressed.ply", b"element chunk 1", b"element chunk 0"),
    ("Gaussians", "compressed.ply/cloud.compressed.ply", b"element vertex 60", b"element vertex 10"),
    ("Gaussians", "ply/cloud.ply", b"element vertex 60", b"element vertex 1000000000000"),
    ("Gaussians", "ply/cloud.ply", b"element vertex 60", b"element vertex " + b"9" * 5_000),
    ("Gaussians", "ply/cloud.ply", b"element vertex 60\n", b"element vertex 60\nelement vertex 60\n"),
    ("Gaussians", "ply/cloud.ply", b"end_header\n", b""),
    ("recording", "csv/log.csv", b"time,", b"speed ,"),
    ("recording", "csv/log.csv", b"\n0.0,", b"\nnoon,"),
    ("route", "points/route.csv", b"1,0,0", b"1,0,0,0"),
    ("route", "tum/route.txt", b"0.10 0 0 1.2", b"0.10 0 0 1e300"),
    ("scene folder", "0/means.npy", b"(60, 3)", b"(1000000000000, 3)"),
    ("scene folder", "0/means.npy", b"<f4", b"|O"),
    ("scene folder", "0/means.npy", b"{'descr'", b"(((((((('"),
    ("stereo folder", "0/poses.txt", b"1 0 0 0 0 1", b"1 0 0 0 0 1e300"),
    ("stereo folder", "0/image_l/000000.png", b"\x00\x00\x00\x0c\x00\x00\x00\x08", b"\x7f\xff\xff\xff\x7f\xff\xff\xff"),
    ("trajectory", "0/t.txt", b"0.10 0 0 1.2", b"0.10 0 0 1e300"),
)  # fmt: skip
"""(parser, document/file, bytes, bytes in their place)."""

COLUMNS: tuple[tuple[str, str, str, pa.Array | None], ...] = tuple(
    (parser, file, column, values)
    for parser, file, column in (
        ("campaign", "0/runs/run-0.parquet", "speed"),
        ("drives", "0/runs/run-0.parquet", "speed"),
        ("recording", "parquet/log.parquet", "speed"),
        ("reference", "0/a.parquet", "speed"),
        ("claim", "station/claim.parquet", "pitch"),
        ("telemetry tables", "0/telemetry/ticks/family=dry/part-0000.parquet", "speed"),
    )
    for values in (
        None,
        pa.array(["x"]),
        pa.array([[1.0]]),
        pa.array([{"a": 1}]),
        pa.array([b"x"]),
        pa.array([0], pa.timestamp("ns")),
    )
)
"""(parser, document/file, column, value that every row gets; None takes the column away)."""
