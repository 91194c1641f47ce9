"""Launch files without code: YAML, TOML and XML, for the model that `actors.launch` has.

    launch:
      - arg: {name: speed, default: 1.5}
      - node: {script: talker.py, name: talker, parameters: {speed: $(var speed)}}

`parsing.py` and `xml_parsing.py` make plain data of a file. `elements.py` says what may stand in it: of that
table come the actions (`reading.py`) and the schema for editors (`schema.py`), so that these two agree.
`kinds.py` and `parameters.py` are the kinds of values, `templates.py` the texts with `$(…)` in them. All of
it is pure.

Imports description.
"""
