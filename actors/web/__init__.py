"""The page that shows the graph live in a browser, its HTTP API, and metrics.

Imports tools and the packages below it; aiohttp and prometheus-client (the extra `web`) only when it is used.
"""
