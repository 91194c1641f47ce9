"""Goals, parameters and transitions together, while processes, links and the broker fail at random."""

from __future__ import annotations

from tests.simulation.robot_history import History
from tests.simulation.stage import Stage, play
from tests.simulation.world import determined


def test_robots_and_operators_agree(history_seed: int) -> None:
    """No call, goal or iterator hangs; each goal ends once; both sides have the same values."""

    async def scene(stage: Stage) -> None:
        with determined(stage.loop, history_seed):
            history = History(stage, history_seed)
            try:
                await history.run()
            except Exception as error:
                error.add_note("\n".join(history.faults))
                raise

    play(scene, history_seed)
