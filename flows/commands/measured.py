"""Commands that read measured data, calibrate vehicles and find the effects that the model lacks."""

from flows.commands.command import (
    CAMPAIGN,
    CAMPAIGN_VEHICLE,
    OUT,
    TRACES,
    VEHICLE,
    Command,
    define_argument,
    define_option,
    select_keys,
)
from flows.commands.measured_results import (
    shorten_agreement,
    shorten_import,
    shorten_verdict,
)

GROUP = "Measured data"
MODE = define_option(
    "mode",
    str | None,
    "Vehicle model: paper or coupled; by default the one that a frozen vehicle was fitted in, else paper.",
    None,
    known=("paper", "coupled"),
)

COMMANDS = (
    Command(
        name="import-measurements",
        group=GROUP,
        sentence="Make a campaign folder of measured recordings, or say what is wrong in which run and channel.",
        function="flows.measured.importing:import_measurements",
        options=(
            define_argument(
                "source",
                str,
                "CSV, Parquet, MDF4, MATLAB, VBOX, ROS bag, MCAP or bus-JSON file, folder of a ROS 2 bag or a KITTI"
                " drive, or a folder of them.",
            ),
            define_option(
                "map",
                str | None,
                "Channel map: YAML file, or the name of one in catalogs/channel_maps.",
                None,
                known="catalogs/channel_maps/*.yaml",
            ),
            define_option("out", str | None, "Campaign folder to make.", None),
            define_option(
                "list_signals",
                bool,
                "List every signal with unit, samples, rate, times and range, and make nothing.",
                False,
            ),
        ),
        brief=shorten_import,
        passed=lambda result: not result.get("faulty"),
    ),
    Command(
        name="vehicle agreement",
        group=GROUP,
        sentence="Compare the vehicle model with reference traces, as the paper's Appendix A.2 does.",
        function="flows.measured.agreement:measure_agreement",
        options=(TRACES, VEHICLE, MODE, OUT),
        brief=shorten_agreement,
    ),
    Command(
        name="vehicle calibrate",
        group=GROUP,
        sentence="Calibrate a vehicle in stages on reference traces, freeze it, and say how well each number is known.",
        function="flows.measured.calibration:calibrate_on_traces",
        options=(
            TRACES,
            define_option("out", str, "Folder for the frozen vehicle and calibration.json."),
            define_option(
                "vehicle",
                str,
                "Vehicle to start from: YAML file, or the name of one in catalogs/vehicles.",
                VEHICLE.default,
                known=VEHICLE.known,
            ),
            define_option(
                "procedure",
                str,
                "Procedure: YAML file, or the name of one in catalogs/calibration.",
                "paper-staged",
                known="catalogs/calibration/*.yaml",
            ),
            define_option("split", str, "Split of the traces to fit; no other split is read.", "development"),
            define_option("name", str, "Name of the frozen vehicle.", "calibrated"),
        ),
        brief=select_keys("vehicle_file", "vehicle_sha256", "stages", "before", "after"),
    ),
    Command(
        name="close-loop",
        group=GROUP,
        sentence="Find the effects that the model lacks in a measured campaign, and write the vehicle with them.",
        function="flows.measured.closing:close_loop",
        options=(
            CAMPAIGN,
            define_option(
                "out", str, "Folder for the verdict, the report and the vehicle with the effects found."
            ),
            CAMPAIGN_VEHICLE,
        ),
        brief=shorten_verdict,
        one_thread=True,
    ),
)
