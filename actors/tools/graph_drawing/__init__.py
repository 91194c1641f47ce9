"""Drawings of the graph of nodes, topics and services: as text, SVG, DOT, Mermaid or plain data.

    from actors.graph.inspector import Inspector
    from actors.tools.graph_drawing.model import model_of
    from actors.tools.graph_drawing.svg import svg_of

    with Inspector("callboard://127.0.0.1:7411") as inspector:
        print(svg_of(model_of(inspector.graph())))

`model.py` chooses the nodes, topics and services to draw. `wiring.py`, `layering.py`, `ordering.py` and
`placing.py` are the steps of `layout.py`, which text and SVG share. Everything here is pure.

Imports the graph's snapshots and proto.
"""
