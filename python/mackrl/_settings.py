"""From what is typed in Python to the layers of a configuration."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TypeAlias

from . import worlds
from ._native import Layers

Setting: TypeAlias = "bool | int | float | str | os.PathLike[str]"
MapName: TypeAlias = "str | os.PathLike[str] | type[worlds.World]"


def toml(value: Setting) -> str:
    """The value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    return json.dumps(os.fspath(value))


def assignment(section: str, name: str, value: Setting) -> tuple[str, str]:
    """What was typed, for messages, and what it means."""
    return f"{name}={value!r}", f"{section}{name}={toml(value)}"


def world_layers(map_name: MapName, settings: Mapping[str, Setting]) -> tuple[str | None, list[tuple[str, str]]]:
    """The map, and the settings, of a world by its name, its scenario file or its class."""
    if isinstance(map_name, type):
        name = worlds.register(map_name)
        arguments = json.dumps(dict(settings), default=os.fspath)
        own = {"name": "python", "map": name, "arguments": arguments}
        return None, [assignment("env.", key, value) for key, value in own.items()]
    return os.fspath(map_name), [assignment("env.", key, value) for key, value in settings.items()]


def environment(map_name: MapName, settings: Mapping[str, Setting]) -> Layers:
    """A world alone."""
    name, assignments = world_layers(map_name, settings)
    return Layers(map=name, settings=assignments)


def threads(count: int | None) -> int:
    """So many threads, or one for each processor that this process may use."""
    if count is not None:
        return count
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
