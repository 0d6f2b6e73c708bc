"""Command that holds emergency brakes against their protocols."""

from flows.commands.command import OUT, VEHICLE, Command, define_option

GROUP = "Evaluation"

COMMANDS = (
    Command(
        name="lab aeb",
        group=GROUP,
        sentence="Emergency brakes against UN R152 and Euro NCAP in every weather: the speed of the impact.",
        function="flows.driving.aeb:compare_brakes",
        options=(
            define_option("vehicle", str, VEHICLE.help, "bmw-320i", known=VEHICLE.known),
            define_option(
                "protocol",
                list[str] | None,
                "Protocol of catalogs/emergency_braking.yaml, or an OpenSCENARIO file; by default each.",
                None,
            ),
            define_option("weather", list[str] | None, "Weather of that file; by default each.", None),
            define_option(
                "brake",
                list[str] | None,
                "blind, friction or driver; by default each.",
                None,
                known=("blind", "friction", "driver"),
            ),
            define_option("bounds", bool, "Drive each approach under the bounds of the surface too.", True),
            OUT,
        ),
        brief=lambda result: {"summary": result["summary"]},
    ),
)
