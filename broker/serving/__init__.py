"""The broker's asyncio shell: listens, reads and writes connections, and gives their frames to the router.

Knows the mesh only by the protocols in `mesh_access`. May import `broker.routing`,
`broker.access` and `proto`.
"""
