"""Parameters of another node: one node checks new values, another reads, sets and watches them.

Beside it run `callboard broker`. Ends by itself.
"""

import asyncio

import callboard


class Thermostat(callboard.Node):
    def __init__(self) -> None:
        super().__init__("thermostat")
        limits = callboard.FloatingPointRange(from_value=5.0, to_value=30.0, step=0.5)
        self.declare_parameter("target", 20.0, callboard.ParameterDescriptor(floating_point_range=[limits]))
        self.declare_parameter("away", value=False)
        self.add_on_set_parameters_callback(self.check)

    def check(self, parameters: list[callboard.Parameter]) -> callboard.SetParametersResult:
        away = self.get_parameter("away").value
        if away and any(each.name == "target" for each in parameters):
            return callboard.SetParametersResult(successful=False, reason="nobody is at home")
        return callboard.SetParametersResult(successful=True)


async def main() -> None:
    async with Thermostat(), callboard.Node("phone") as phone:
        changed = asyncio.Event()

        def on_away(parameter: callboard.Parameter) -> None:
            print(f"away is {parameter.value} now")
            changed.set()

        handler = callboard.ParameterEventHandler(phone)
        handler.add_parameter_callback("away", "/thermostat", on_away)
        thermostat = callboard.ParameterClient(phone, "/thermostat")
        print("target:", (await thermostat.get_parameters(["target"]))[0].value)
        for name, value in (("target", 21.5), ("target", 21.3), ("away", True), ("target", 18.0)):
            (result,) = await thermostat.set_parameters([callboard.Parameter(name, value=value)])
            print(name, value, "is set" if result.successful else f"is refused: {result.reason}")
        await changed.wait()


if __name__ == "__main__":
    callboard.run(main)
