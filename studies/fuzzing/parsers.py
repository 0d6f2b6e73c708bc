"""Every parser of what a stranger may have written."""

from functools import partial

from catalogs.campaigns import read_campaign
from catalogs.entries import load
from catalogs.references import read_reference
from catalogs.scenes.folder import read_scene
from catalogs.scenes.gaussian_files import read_gaussians
from catalogs.scenes.route_files import read_route
from catalogs.scenes.stereo_folder import read_stereo_folder
from catalogs.scenes.street import load_street_layout
from flows.making.plan import read_plan
from flows.making.seal import seal_dataset
from flows.reading.describe import validate_grid
from flows.store.layout import Layout
from flows.store.outputs import read_marker
from flows.store.sealed import read_manifest
from manifests.frozen_run import read_frozen
from studies.closing_benchmark.truths import load_sizes, load_truths
from studies.evaluation.learned_judges import load_judges
from studies.foreign_video.judge import read_claim
from studies.foreign_video.sources import read_camera, read_footage
from studies.foreign_video.trajectories import read_trajectory
from studies.fuzzing import recorded, seals, sound
from studies.fuzzing.parser import Parser, parse_entries
from studies.fuzzing.readers import (
    import_scene,
    read_dataset,
    read_recording,
    read_signature,
    read_tables,
    read_weather,
    remove_cache,
)
from studies.fuzzing.rules import (
    CELLS_FINITE,
    FINITE,
    INF,
    NAN,
    Rule,
    files_inside,
    hashes_keep_their_form,
    ids_keep_their_form,
    limit_values,
)
from studies.measured_drives.drives import read_drives
from studies.measured_drives.plans import load_plan
from studies.physics_judge.frozen_constants import read_constants

NUMBERS_OF_A_GRID = (
    limit_values("precipitation_mm_h", -1, 50_000, 1e308),
    limit_values("initial_speed_km_h", -1, 5_000, 1e308),
    limit_values("peak_pressure_mpa", -1, 300, 1e300),
    limit_values("frames", -1, 0, 1, 2**31, 2**70),
    limit_values("frame_rate_hz", -1, 0, 1e9),
    limit_values("seed", -1, 2**53),
)
RECORDED_FILES = r"(clips\|\d+\|)?artifacts\|[^|]+"
PLANS = "../studies/measured_drives"
TRUTHS = "../studies/closing_benchmark/truths.yaml"
PLANNED = (
    ids_keep_their_form(r"clips\|\d+\|clip_id|run_id"),
    hashes_keep_their_form(r"inputs\|[^|]+|scene\|sha256"),
    files_inside(r"inputs\|[^|]+", of_keys=True),
    FINITE,
)
RECORDED = (
    *PLANNED,
    files_inside(RECORDED_FILES, of_keys=True),
    hashes_keep_their_form(RECORDED_FILES),
)

PARSERS: tuple[Parser, ...] = (
    Parser(
        name="grid", write=sound.write_grids, read=lambda folder: load("grid", folder / "grid.yaml"), share=8,
        rules=(FINITE, *NUMBERS_OF_A_GRID), known_keys=r"|base|latin_hypercube|(axes\|[^|]+|scenarios)\|[^|]+",
    ),
    Parser(
        name="planned grid", write=sound.planned_grids, targets=("grid.yaml",), share=1,
        read=lambda folder: validate_grid(str(folder / "grid.yaml")), rules=(FINITE, *NUMBERS_OF_A_GRID),
        known_keys=r"|base|axes\|[^|]+\|[^|]+",
    ),
    parse_entries("vehicle", "vehicles/[bp]*.yaml", partial(load, "vehicle"), share=4),
    parse_entries("frozen vehicle", "vehicles/m*.yaml", partial(load, "vehicle"), share=1, reseal=seals.sealed_vehicle),
    parse_entries("surface", "surfaces/*.yaml", partial(load, "surface"), share=3),
    parse_entries("camera", "cameras/*.yaml", partial(load, "camera"), share=4),
    parse_entries("gates", "gates.yaml", partial(load, "gate file"), share=2),
    parse_entries("foreign gates", "foreign_gates.yaml", partial(load, "foreign gate file"), share=2),
    parse_entries("hazard marking", "hazard_markings/*.yaml", partial(load, "hazard marking"), share=2),
    parse_entries("bus", f"{PLANS}/a2d2-like.yaml", partial(load_plan, "bus"), share=2),
    parse_entries("calibration procedure", "calibration/*.yaml", partial(load, "calibration procedure"), share=2),
    parse_entries("protocol", f"{PLANS}/brake-dive.yaml", partial(load_plan, "protocol"), share=2),
    parse_entries("stop study", f"{PLANS}/bmw-m8.yaml", partial(load_plan, "stop study"), share=2),
    parse_entries("bump study", f"{PLANS}/comma2k19.yaml", partial(load_plan, "bump study"), share=2),
    parse_entries("sensitivity study", "studies/surface-sensitivity.yaml", partial(load, "sensitivity study"), share=1),
    parse_entries("street", "scenes/street.yaml", load_street_layout, share=2),
    parse_entries("effects library", "effects/library.yaml", partial(load, "library of effects"), share=0.5),
    parse_entries("truths", TRUTHS, load_truths, share=0.5),
    parse_entries("sizes", TRUTHS, load_sizes, share=0.5),
    parse_entries(
        "channel map", "channel_maps/*.yaml", partial(load, "channel map"), share=3,
        rules=(files_inside(r"runs\|\d+\|file"),),
    ),
    Parser(
        name="weather", write=sound.write_weather, read=read_weather, share=1, known_keys=".*",
        rules=(FINITE, Rule(name="values have unit and source", where=r".*\|(unit|source)", values=("", 7, None)),
               Rule(name="units are those of the field", where=r"(surface|tyre)\|.*\|unit", values=("furlong",))),
    ),
    Parser(
        name="learned judges", share=1, known_keys=".*", read=lambda folder: load_judges(folder / "judges.yaml"),
        write=sound.write_texts({"judges.yaml": "clip: {checkpoint: a.pt, text_features: b.npy, source: c}\n"
                                          "dover: {checkpoint: dover.pt, source: d}\n"}),
    ),
    Parser(
        name="manifest", write=sound.write_dataset, targets=(r"manifest\.json",), read=read_dataset, share=2,
        sealed=r".*",
        rules=RECORDED, reseal=seals.sealed_json,
    ),
    Parser(
        name="manifest alone", write=sound.write_dataset, targets=(r"manifest\.json",), share=4, rules=RECORDED,
        read=lambda folder: read_manifest(Layout(folder)), reseal=seals.sealed_json,
    ),
    Parser(
        name="telemetry", write=sound.write_dataset, targets=(r"telemetry/.*\.parquet",), read=read_dataset, share=0.5,
        sealed=r".*",
        reseal=seals.sealed_dataset,
    ),
    Parser(
        name="telemetry tables", write=sound.write_dataset, read=read_tables, share=1,
        targets=(r"telemetry/clips\.parquet", r"telemetry/(ticks|frames)/.*"),
    ),
    Parser(
        name="frozen inputs", write=sound.write_dataset, share=1, read=read_constants,
        targets=(r"inputs/(vehicle|surface)\.yaml", r"plan\.json"),
    ),
    Parser(
        name="plan", write=sound.write_dataset, targets=(r"plan\.json",), read=remove_cache(read_plan), share=5,
        rules=PLANNED,
    ),
    Parser(
        name="receipt", write=sound.unfinished_dataset, targets=(r"\.staging/.*\.json",), share=1, writes=True,
        read=lambda folder: seal_dataset(Layout(folder), remove_cache(read_plan)(folder)),
        rules=(ids_keep_their_form("clip_id"), files_inside(r"artifacts\|[^|]+", of_keys=True), FINITE,
               hashes_keep_their_form(r"artifacts\|[^|]+")),
    ),
    Parser(
        name="frozen run", write=sound.frozen_runs, read=lambda folder: read_frozen(folder / "run.json"), share=4,
        reseal=seals.sealed_json, rules=(FINITE,),
    ),
    Parser(
        name="signature", write=sound.signed_dataset, read=read_signature, share=3, known_keys=None,
        targets=(r"manifest\.dsse\.json", r"public\.pem"),
    ),
    Parser(
        name="signed manifest", write=sound.signed_dataset, read=read_signature, share=2, sealed=r".*",
        targets=(r"manifest\.json",),
    ),
    Parser(
        name="marker of outputs", share=2, read=lambda folder: read_marker(folder), targets=(r"\.musync-written",),
        rules=(files_inside(r"files\|[^|]+", of_keys=True),),
        write=sound.write_texts({".musync-written": '{"files": {"a.csv": "sheets", "b/c.png": "report"},'
                                              ' "format": "musync-written/1"}'}),
    ),
    Parser(
        name="campaign", write=recorded.write_campaign, read=read_campaign, share=5,
        rules=(FINITE, CELLS_FINITE, files_inside("run")),
    ),
    Parser(
        name="drives", write=recorded.write_campaign, read=read_drives, share=3,
        rules=(Rule(name="numbers are finite", where="sample_rate_hz", values=(NAN, INF)),
               Rule(name="numbers are finite", where="precipitation_mm_h|snow_accumulation_h", numbers_only=True,
                    values=("nan", "inf")), files_inside("run")),
    ),
    Parser(
        name="recording", write=recorded.write_recordings, targets=(r"log\..*",), share=4, read=read_recording,
    ),
    Parser(
        name="MATLAB recording", write=recorded.write_matlab_recordings, targets=(r"log\..*",), share=2,
        read=read_recording,
    ),
    Parser(name="bag", write=recorded.write_bags, targets=(r"log\..*",), share=2, read=read_recording),
    Parser(
        name="reference", write=recorded.write_references, read=read_reference, share=4,
        rules=(FINITE, files_inside(r"\d+\|case"), Rule(name="cases are names", where=r"\d+\|case", values=("*", "?"))),
    ),
    Parser(
        name="Gaussians", write=recorded.gaussian_files, share=8,
        read=lambda folder: read_gaussians(next(folder.glob("cloud.*"))),
    ),
    Parser(name="scene import", write=recorded.write_import, read=import_scene, share=1, writes=True),
    Parser(
        name="scene folder", write=sound.scene_folders, read=read_scene, share=6, reseal=seals.sealed_scene,
        sealed=r".*\.npy",
        rules=(FINITE, files_inside(r"sha256\|.*", of_keys=True), hashes_keep_their_form(r"sha256\|.*")),
    ),
    Parser(
        name="route", write=recorded.write_routes, share=6, rules=(FINITE, CELLS_FINITE),
        read=lambda folder: read_route(next(folder.glob("route.*")), 1.65),
    ),
    Parser(
        name="stereo folder", write=recorded.stereo_folders, share=2, rules=(CELLS_FINITE,), read=read_stereo_folder
    ),
    Parser(
        name="trajectory", write=sound.write_texts({"t.txt": recorded.trajectory_text()}), share=2,
        rules=(CELLS_FINITE,), read=lambda folder: read_trajectory(folder / "t.txt"),
    ),
    Parser(
        name="video", write=recorded.write_videos, share=0.5,
        read=lambda folder: read_footage(next(folder.glob("video.*"))),
    ),
    Parser(
        name="claim", write=recorded.write_claims, read=lambda folder: read_claim(folder / "claim.parquet"), share=3,
        rules=(FINITE,),
    ),
    Parser(
        name="video's camera", share=2, read=lambda folder: read_camera(folder / "camera.yaml"), rules=(FINITE,),
        write=sound.write_texts({"camera.yaml": "width: 640\nheight: 360\nfocal_length: 500\n"},
                          {"camera.yaml": "width: 640\nheight: 360\nfx: 500\nfy: 500\ncx: 320\ncy: 180\nk1: 0.1\n"
                                          "height_above_road: {value: 1.4, unit: m, source: measured}\n"}),
    ),
)  # fmt: skip
BY_NAME = {parser.name: parser for parser in PARSERS}
