"""What is wrong with a key of a study file that no bed of the core has."""

from collections.abc import Callable

Hint = Callable[[str, str], tuple[str, str] | None]
HINTS: list[Hint] = []
"""Each is asked with a table and a key, and says what is wrong and the remedy, or None.

A guest adds a hint on the keys of its own beds.
"""
