"""The graph of nodes, topics and services as a picture: in a terminal, as SVG, DOT, Mermaid or data.

    from actors.graph.inspector import Inspector
    from actors.tools.graph_drawing.model import model_of
    from actors.tools.graph_drawing.svg import svg_of

    with Inspector("callboard://127.0.0.1:7411") as inspector:
        print(svg_of(model_of(inspector.graph())))

`model.py` says what is drawn. `wiring.py`, `layering.py`, `ordering.py` and `placing.py` are the steps of
`layout.py`, which terminal and SVG share. Everything here is a pure function.
"""
