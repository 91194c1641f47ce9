"""Bags: recordings of topics in the files of rosbag2, which everybody's tools read.

    with Writer("trip") as bag:
        number = bag.add_topic(BagTopic.of_class("/chatter", String))
        bag.write(number, cdr.encode(String(data="hello")), now_ns, now_ns)

`records.py` has what a bag consists of, `definitions.py` the texts of types, `metadata.py` and `qos_lists.py`
what metadata.yaml says. Only `mcap_*.py` import the library `mcap`, and `compress*.py` zstandard and lz4:
they come with the extra `bags`, and are imported when a bag is opened. Imports node and the packages
below it.
"""

from __future__ import annotations

from actors.lazy import lazy_imports

with lazy_imports(__name__):
    from actors.bags.errors import BagError as BagError
    from actors.bags.errors import BagExistsError as BagExistsError
    from actors.bags.errors import BagFullError as BagFullError
    from actors.bags.errors import BagNotFoundError as BagNotFoundError
    from actors.bags.errors import BagWriteError as BagWriteError
    from actors.bags.errors import InvalidBagError as InvalidBagError
    from actors.bags.errors import MissingExtraError as MissingExtraError
    from actors.bags.files import Order as Order
    from actors.bags.player.options import PlayerOptions as PlayerOptions
    from actors.bags.player.player import Player as Player
    from actors.bags.reader import BagSummary as BagSummary
    from actors.bags.reader import Reader as Reader
    from actors.bags.recorder.options import RecorderOptions as RecorderOptions
    from actors.bags.recorder.recorder import Recorder as Recorder
    from actors.bags.recorder.selection import Selection as Selection
    from actors.bags.records import BagMessage as BagMessage
    from actors.bags.records import BagTopic as BagTopic
    from actors.bags.writer import Writer as Writer
