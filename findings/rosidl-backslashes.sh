#!/usr/bin/env bash
# ros-rosidl-generator-py 0.24.2, ros-rosidl-adapter and ros-rosidl-parser 4.9.5 (ROS 2 Kilted), Python 3.11 on
# Linux x86-64, seen on 2026-11-27.
#
# A string constant with an escaped backslash: string FOLDER="C:\\temp"
#
# Guess: the constant of the Python class is C:\temp.
# Seen: it has a tab: the adapter keeps both backslashes, the parser makes one of them, and the generator writes that
#       between quotes without escaping it, as 'C:\temp'. For a backslash four of them are needed.
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

folder = pathlib.Path.cwd()
(folder / "msg").mkdir()
(folder / "msg" / "M.msg").write_text('string TWO="C:\\\\temp"\nstring FOUR="C:\\\\\\\\temp"\n')
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
seen = {}
for node in ast.walk(ast.parse((folder / "out" / "msg" / "_m.py").read_text())):
    for key, value in zip(node.keys, node.values) if isinstance(node, ast.Dict) else ():
        if isinstance(key, ast.Constant) and key.value in {"TWO", "FOUR"} and isinstance(value, ast.Constant):
            seen[key.value] = value.value
print(seen)
sys.exit(seen != {"TWO": "C:\temp", "FOUR": "C:\\temp"})
PYTHON
