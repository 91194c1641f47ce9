"""Launch files without code: YAML, TOML and XML, for the model that `actors.launch` has.

    launch:
      - arg: {name: speed, default: 1.5}
      - node: {script: talker.py, name: talker, parameters: {speed: $(var speed)}}

`parsing.py` and `xml_parsing.py` turn a file into plain data, and `reading.py` turns that into actions.
`elements.py` has the elements and their keys, which follow from the options of actions; the schema for
editors (`schema.py`) follows from them, too. `kinds.py` and `parameters.py` are the kinds of values. All of
it is pure.

Imports description.
"""
