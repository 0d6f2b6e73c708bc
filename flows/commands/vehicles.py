"""Commands for a car of one's own: a file for its data sheet, what of its numbers is implausible, and an FMU of it."""

from flows.commands.command import (
    VEHICLE,
    Command,
    define_argument,
    define_option,
    require_key,
    select_keys,
)

GROUP = "Measured data"

COMMANDS = (
    Command(
        name="vehicle new",
        group=GROUP,
        sentence="Write a short file for the data sheet of a car, which inherits every other number.",
        function="flows.measured.vehicle_check:make_vehicle_template",
        options=(
            define_option("out", str, "File to write, NAME.yaml; it must not exist."),
            define_option(
                "base",
                str,
                "Vehicle to inherit from: a name, or a file in the folder of --out.",
                "bmw-320i",
                spelling="from",
                known=VEHICLE.known,
            ),
            define_option(
                "name", str | None, "Name of the car in the file; by default the file's name.", None
            ),
        ),
    ),
    Command(
        name="vehicle check",
        group=GROUP,
        sentence="Say which figures of a vehicle are implausible, and which of its numbers to look at.",
        function="flows.measured.vehicle_check:check_vehicle",
        options=(define_argument("vehicle", str, VEHICLE.help, known=VEHICLE.known),),
        passed=require_key("plausible"),
        output="sentences",
    ),
    Command(
        name="vehicle fmu",
        group=GROUP,
        sentence="Write a vehicle as a co-simulation FMU (FMI 2.0), which Simulink, CarMaker or Modelica drive.",
        function="flows.exporting.fmu:write_fmu",
        options=(
            define_argument("vehicle", str, VEHICLE.help, known=VEHICLE.known),
            define_option("out", str, "File to write, NAME.fmu."),
            define_option(
                "platforms",
                list[str] | None,
                "Where it will run, by default here: linux64, win64 or darwin64; may be given more than once, and"
                " others than this one need pip install 'musync-gs[fmu]'.",
                None,
                spelling="platform",
                known=("linux64", "win64", "darwin64"),
            ),
            define_option(
                "surface",
                str,
                "Pavement whose dry friction is the friction at the start.",
                "dense-asphalt",
                known="catalogs/surfaces/*.yaml",
            ),
        ),
        brief=select_keys("fmu", "vehicle", "platforms", "step_s", "weathers"),
    ),
)
