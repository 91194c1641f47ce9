#!/usr/bin/env bash
# ros-rosidl-generator-py 0.24.2 with ros-rosidl-adapter 4.9.5 (ROS 2 Kilted), Python 3.11 on Linux x86-64,
# seen on 2026-11-27.
#
# A .msg file may give an array a default, and the default may be empty: `int8[] levels []`.
#
# Guess: the Python class begins with an empty array, as without a default.
# Seen: adapter, parser and generator end without an error, and the module that they have written does not compile:
#       the default is `array.array('b', (, ))`. With one element in the default it is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check \
    ros-rosidl-generator-py==0.24.2 ros-rosidl-adapter==4.9.5 ros-rosidl-parser==4.9.5
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import ast
import json
import pathlib
import sys

from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_generator_py import generate_py


def error_in(line, folder):
    (folder / "msg").mkdir(parents=True)
    (folder / "msg" / "M.msg").write_text(f"{line}\n")
    convert_msg_to_idl(folder, "pkg", pathlib.Path("msg/M.msg"), folder / "idl" / "msg")
    arguments = folder / "arguments.json"
    arguments.write_text(
        json.dumps({
            "package_name": "pkg",
            "output_dir": str(folder / "out"),
            "template_dir": str(pathlib.Path(sys.prefix) / "share" / "rosidl_generator_py" / "resource"),
            "idl_tuples": [f"{folder / 'idl'}:msg/M.idl"],
            "target_dependencies": [],
            "ros_interface_dependencies": [],
        })
    )
    generate_py(str(arguments), [])
    try:
        ast.parse((folder / "out" / "msg" / "_m.py").read_text())
    except SyntaxError as error:
        return error.text.strip()
    return None


seen = {line: error_in(line, pathlib.Path.cwd() / name) for name, line in
        (("one", "int8[] levels [1]"), ("none", "int8[] levels []"))}
print(seen)
sys.exit(seen != {"int8[] levels [1]": None, "int8[] levels []": "'LEVELS__DEFAULT': array.array('b', (, )),"})
PYTHON
