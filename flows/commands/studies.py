"""Commands that repeat the paper's studies and measure speed."""

from flows.commands.command import OUT, VEHICLE, Command, define_argument, define_option, select_keys

GROUP = "Studies"
MODE = define_option(
    "mode",
    str | None,
    "Vehicle model: paper or coupled; by default the one that a frozen vehicle was fitted in, else paper.",
    None,
    known=("paper", "coupled"),
)

COMMANDS = (
    Command(
        name="lab sensitivity",
        group=GROUP,
        sentence="Reproduce the paper's bounded surface-parameter study (Appendix E) beside its printed figures.",
        function="flows.studies.vehicle_model:run_sensitivity",
        options=(OUT,),
        brief=select_keys("solver_cases", "cpu_s", "beside_print"),
        passed=lambda result: all(row["agrees"] for row in result["beside_print"]),
    ),
    Command(
        name="lab ablation",
        group=GROUP,
        sentence="Cut one coupling at a time (the paper's Section 4.4): stops over the weather, pitch at a hump.",
        function="flows.studies.ablation:run_ablation",
        options=(
            define_option("out", str, "Folder for ablation.json, .parquet, .svg and .html."),
            define_option("vehicle", str, VEHICLE.help, "paper-reference", known=VEHICLE.known),
            MODE,
            define_option(
                "traces",
                str | None,
                "Folder of reference traces, whose pitch is drawn beside the model's.",
                None,
            ),
        ),
        brief=select_keys("pitch", "reference"),
    ),
    Command(
        name="lab bench",
        group=GROUP,
        sentence="Measure speed and memory, beside another implementation in the same run.",
        function="flows.studies.vehicle_model:run_benchmarks",
        options=(define_argument("name", str | None, "Benchmark to run; by default all.", None), OUT),
        is_flow=False,
    ),
)
