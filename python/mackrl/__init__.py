"""Multi-agent common-knowledge reinforcement learning: worlds in NumPy arrays, and teams that coordinate without communicating.

``VectorEnv`` steps thousands of worlds; ``train`` teaches a team, ``Run`` is what it leaves, ``mackrl.policy`` acts with it. Other
interfaces stand in modules of their own: ``mackrl.smac``, ``mackrl.pettingzoo``, ``mackrl.gymnasium``.
"""

from . import policy
from ._native import VERSION as __version__
from ._native import maps
from .arrays import Buffers, Spec, Step
from .errors import IllegalAction, WorldFailed
from .runs import Progress, Replay, Run, play, train
from .vector import VectorEnv
from .worlds import World, check_world

__all__ = [
    "Buffers",
    "IllegalAction",
    "Progress",
    "Replay",
    "Run",
    "Spec",
    "Step",
    "VectorEnv",
    "World",
    "WorldFailed",
    "__version__",
    "check_world",
    "maps",
    "play",
    "policy",
    "train",
]
