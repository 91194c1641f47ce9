"""Measures the page: real processes, and Chromium by Playwright."""
