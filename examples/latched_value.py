"""A latched value: a late subscription gets the last value, because its publisher is TRANSIENT_LOCAL.

Beside it run `callboard broker`. Ends by itself.
"""

import callboard
from actors.interfaces.std_msgs.msg import String

LATCHED = callboard.QoSProfile(depth=1, durability=callboard.DurabilityPolicy.TRANSIENT_LOCAL)


async def main() -> None:
    async with callboard.Node("map_server") as server:
        publisher = server.create_publisher(String, "map", LATCHED)
        for name in ("cellar", "ground floor", "attic"):
            publisher.publish(String(data=name))
            print(f"published: {name}")
        await publisher.flush()

        async with callboard.Node("late_joiner") as joiner:
            async for msg in joiner.create_subscription(String, "map", qos_profile=LATCHED):
                print(f"the late joiner got: {msg.data}")
                break


if __name__ == "__main__":
    callboard.run(main)
