"""What ROS 2's build makes of a package of interfaces, without a compiler: IDL and type hashes."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path

from rosidl_adapter.action import convert_action_to_idl
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_generator_type_description import generate_type_hash

CONVERT = {"msg": convert_msg_to_idl, "srv": convert_srv_to_idl, "action": convert_action_to_idl}
SHARE = Path(sys.prefix, "share")


def hashes(package, files):
    """Return the hashes of all types of a package, by type name.

    Args:
        package: Its name.
        files: Path to content, such as "msg/Wheel.msg". They may use types of installed packages.
    """
    # The converters print what they read and write.
    with tempfile.TemporaryDirectory() as temporary, contextlib.redirect_stdout(io.StringIO()):
        folder = Path(temporary)
        idl = [_converted(folder, package, path, text) for path, text in files.items()]
        arguments = {
            "package_name": package,
            "output_dir": str(folder / "out"),
            "idl_tuples": [f"{folder}:{path}" for path in idl],
            "include_paths": [f"{each.name}:{each}" for each in SHARE.iterdir()],
        }
        (folder / "arguments.json").write_text(json.dumps(arguments))
        documents = [
            json.loads(path.read_text()) for path in generate_type_hash(str(folder / "arguments.json"))
        ]
    found = {
        each["type_name"]: each["hash_string"] for document in documents for each in document["type_hashes"]
    }
    return {name: found[name] for name in sorted(found) if name.startswith(f"{package}/")}


def _converted(folder, package, path, text):
    """Write a file, and return the path of the IDL file that is made of it."""
    file = folder / path
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")
    CONVERT[file.parent.name](folder, package, Path(path), file.parent)
    return Path(path).with_suffix(".idl")
