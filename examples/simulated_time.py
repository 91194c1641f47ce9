"""Simulated time: an hour of a node's work passes in a moment, and is then repeated.

Beside it run `callboard broker`. Ends by itself.
"""

import asyncio

import callboard
from actors.testing import SimulatedClock
from callboard import Duration, JumpThreshold, Time, TimeJump


class Heater(callboard.Node):
    def __init__(self) -> None:
        super().__init__("heater", parameter_overrides={"use_sim_time": True})
        back = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1))
        self.get_clock().create_jump_callback(back, post_callback=self.set_back)
        self.checks = self.create_timer(60, lambda: None)

    def now(self) -> str:
        minutes, seconds = divmod(self.get_clock().now().nanoseconds // 10**9, 60)
        return f"{minutes:02}:{seconds:02}"

    def set_back(self, jump: TimeJump) -> None:
        print(f"{self.now()} time was set back by {-jump.delta.nanoseconds / 1e9:g} s")

    async def warm_up(self) -> None:
        await self.get_clock().sleep_until(Time(seconds=600, clock_type=callboard.ClockType.ROS_TIME))
        print(f"{self.now()} is warm")
        rate = self.create_rate(1 / 1200)
        for _ in range(2):
            await rate.sleep()
            print(f"{self.now()} is still warm")


async def main() -> None:
    async with callboard.Node("simulator") as simulator, Heater() as heater:
        clock = SimulatedClock(simulator, heater)
        await clock.set(0)
        for _ in range(2):
            warming = asyncio.create_task(heater.warm_up())
            await clock.advance(3600, step=5)
            await warming
            await clock.set(0)
        print(f"{heater.checks.ticks} checks")


if __name__ == "__main__":
    callboard.run(main)
