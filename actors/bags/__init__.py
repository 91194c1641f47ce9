"""Bags: recordings of topics in the file formats of rosbag2, so that other tools can read them.

    with Writer("trip") as bag:
        number = bag.add_topic(BagTopic.of_class("/chatter", String))
        bag.write(number, cdr.encode(String(data="hello")), now_ns, now_ns)

`contents/` has the parts of a bag as plain data. `storage/` reads and writes single files: only its modules
import the libraries of the extra `bags`, when a file is opened. `reader.py` and `writer.py` are for whole
bags; `operations/` checks, converts, exports and repairs them. `recorder/` and `player/` are nodes, which
share the modules beside them: `selection.py`, `qos_override_file.py`, `pause_services.py` and
`supervised_tasks.py`. Imports node and the packages below it.
"""

from __future__ import annotations

from actors.lazy import lazy_imports

with lazy_imports(__name__):
    from actors.bags.contents.records import BagMessage as BagMessage
    from actors.bags.contents.records import BagTopic as BagTopic
    from actors.bags.errors import BagError as BagError
    from actors.bags.errors import BagExistsError as BagExistsError
    from actors.bags.errors import BagFullError as BagFullError
    from actors.bags.errors import BagNotFoundError as BagNotFoundError
    from actors.bags.errors import BagWriteError as BagWriteError
    from actors.bags.errors import InvalidBagError as InvalidBagError
    from actors.bags.errors import InvalidBagOptionError as InvalidBagOptionError
    from actors.bags.errors import MissingExtraError as MissingExtraError
    from actors.bags.player.options import PlayerOptions as PlayerOptions
    from actors.bags.player.played_service import RequestsSource as RequestsSource
    from actors.bags.player.player import Player as Player
    from actors.bags.reader import BagSummary as BagSummary
    from actors.bags.reader import Reader as Reader
    from actors.bags.recorder.options import RecorderOptions as RecorderOptions
    from actors.bags.recorder.recorder import Recorder as Recorder
    from actors.bags.selection import Selection as Selection
    from actors.bags.storage.bag_file import Order as Order
    from actors.bags.writer import Writer as Writer
