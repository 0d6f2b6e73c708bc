"""The pipeline's commands as Prefect flows, for a server, a schedule or a work pool.

Each flow is the plain function of the same name; its stages (see `flows.running.orchestration`) become task runs, and
the clips fan out on the chosen runner from inside one of them. Results are never persisted by Prefect:
receipts and hashes on disk decide what is done.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

QUIET_AND_LOCAL = {
    "DO_NOT_TRACK": "1",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "PREFECT_LOGGING_LEVEL": "WARNING",
    # what ended a run is told in a sentence by the command; the traceback stands in the run's log on the server
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",
    "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
    "PREFECT_HOME": str(Path.cwd() / ".musync" / "prefect"),
}
for _name, _value in QUIET_AND_LOCAL.items():
    os.environ.setdefault(_name, _value)
# Prefect's database fails to open in a home that does not exist yet
Path(os.environ["PREFECT_HOME"]).mkdir(parents=True, exist_ok=True)

from prefect import flow  # noqa: E402  (reads the environment when it is imported)

from flows.auditing import audit as _audit  # noqa: E402
from flows.auditing import dataset_diff as _dataset_diff  # noqa: E402
from flows.auditing import explain as _explain  # noqa: E402
from flows.auditing import repair as _repair  # noqa: E402
from flows.auditing import verify as _verify  # noqa: E402
from flows.judging import controls as _controls  # noqa: E402
from flows.judging import evaluation as _evaluation  # noqa: E402
from flows.judging import foreign as _foreign  # noqa: E402
from flows.judging import physics as _physics  # noqa: E402
from flows.making import freezing as _freezing  # noqa: E402
from flows.making import generate as _generate  # noqa: E402
from flows.making import reconstruction as _reconstruction  # noqa: E402
from flows.making import replay as _replay  # noqa: E402
from flows.making import scenes as _scenes  # noqa: E402
from flows.measured import bump_study as _bump_study  # noqa: E402
from flows.measured import calibration as _calibration  # noqa: E402
from flows.measured import closing as _closing  # noqa: E402
from flows.measured import closing_benchmark as _closing_benchmark  # noqa: E402
from flows.measured import importing as _importing  # noqa: E402
from flows.measured import protocol as _protocol  # noqa: E402
from flows.measured import stop_study as _stop_study  # noqa: E402
from flows.reading import describe as _describe  # noqa: E402
from flows.reading import previews as _previews  # noqa: E402
from flows.reading import query as _query  # noqa: E402
from flows.reading import report as _report  # noqa: E402
from flows.reading import sheets as _sheets  # noqa: E402
from flows.studies import vehicle_model as _studies  # noqa: E402


def as_flow(function: Callable[..., Any]) -> Any:
    """The Prefect flow of a pipeline function."""
    name = f"musync-{function.__name__.replace('_', '-')}"
    description = (function.__doc__ or "").split("\n")[0]
    return flow(name=name, persist_result=False, description=description)(function)


generate = as_flow(_generate.generate)
reproduce = as_flow(_freezing.reproduce)
freeze = as_flow(_freezing.freeze)
audit = as_flow(_audit.audit)
audit_physics = as_flow(_physics.audit_physics)
verify = as_flow(_verify.verify)
repair = as_flow(_repair.repair)
gc = as_flow(_verify.gc)
explain = as_flow(_explain.explain)
sql = as_flow(_query.sql)
schema = as_flow(_query.schema)
evaluate = as_flow(_evaluation.evaluate)
controls = as_flow(_controls.controls)
judge = as_flow(_foreign.judge)
describe = as_flow(_describe.describe)
validate = as_flow(_describe.validate)
replay_audit = as_flow(_replay.replay_audit)
preview = as_flow(_previews.preview)
report = as_flow(_report.report)
sheets = as_flow(_sheets.sheets)
sensitivity = as_flow(_studies.sensitivity)
agreement = as_flow(_studies.agreement)
calibrate = as_flow(_calibration.calibrate)
scene_from_stereo = as_flow(_reconstruction.scene_from_stereo)
scene_import = as_flow(_scenes.scene_import)
import_measurements = as_flow(_importing.import_measurements)
brake_protocol = as_flow(_protocol.brake_protocol)
stop_study = as_flow(_stop_study.stop_study)
diff = as_flow(_dataset_diff.diff)
bump_study = as_flow(_bump_study.bump_study)
close_loop = as_flow(_closing.close_loop)
close_loop_benchmark = as_flow(_closing_benchmark.close_loop_benchmark)
