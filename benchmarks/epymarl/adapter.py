"""Runs EPyMARL's own program on this simulator and measures it, a window at a time. `compare.py` starts it:

    python adapter.py EPYMARL/src/main.py THREADS REPORTS ARGUMENTS…

REPORTS is the number of a file descriptor, which gets a line of JSON once the learner is made (what learns, on what), then one
for each window. A line on standard input, a number of seconds, begins a window; the end of that input ends the program. Windows
begin and end where an episode begins, so each holds whole episodes and what was learnt from them.
"""

import json
import os
import runpy
import sys
import time
import types

import mackrl.smac
import torch
from mackrl import _native

UPDATES_BEFORE = 5


class Meter:
    """Counts steps, episodes and updates, and waits between two windows."""

    def __init__(self, reports):
        self.reports = os.fdopen(reports, "w")
        self.steps = self.episodes = self.updates = 0
        self.window = None

    def report(self, fact):
        print(json.dumps(fact, default=str), file=self.reports, flush=True)

    def episode_begins(self):
        """Ends the window that is long enough and waits for the next one."""
        if self.updates >= UPDATES_BEFORE and (self.window is None or self.window_ends()):
            asked = sys.stdin.readline()
            if not asked:
                os._exit(0)
            self.window = float(asked), self.now()
        self.episodes += 1

    def window_ends(self):
        seconds, begun = self.window
        now = self.now()
        if now["wall_s"] - begun["wall_s"] < seconds:
            return False
        self.report({name: now[name] - begun[name] for name in now})
        return True

    def now(self):
        return {
            "wall_s": time.perf_counter(),
            "cpu_s": time.process_time(),
            "steps": self.steps,
            "episodes": self.episodes,
            "updates": self.updates,
        }


def main():
    program, threads, reports = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    sys.argv = [program, *sys.argv[4:]]
    sys.path.insert(0, os.path.dirname(program))
    # EPyMARL imports its wrapper of SMAClite whatever is played; that game is in no package index.
    sys.modules.setdefault("smaclite", types.ModuleType("smaclite"))
    meter = Meter(reports)
    mackrl.smac.install(replace=True)
    sys.modules["smac.env"].StarCraft2Env = metered_environment(meter, threads)
    import learners

    learners.REGISTRY["q_learner"] = metered_learner(learners.REGISTRY["q_learner"], meter)
    runpy.run_path(program, run_name="__main__")


def metered_environment(meter, threads):
    class MeteredEnvironment(mackrl.smac.StarCraft2Env):
        def __init__(self, **arguments):
            super().__init__(**arguments)
            meter.episode_limit = self.episode_limit
            # EPyMARL's program sets one thread before it makes the environment.
            torch.set_num_threads(threads)

        def reset(self):
            meter.episode_begins()
            return super().reset()

        def step(self, actions):
            meter.steps += 1
            return super().step(actions)

    return MeteredEnvironment


def metered_learner(learner, meter):
    class MeteredLearner(learner):
        def __init__(self, mac, scheme, logger, args):
            super().__init__(mac, scheme, logger, args)
            meter.report(
                {
                    "settings": vars(args),
                    "shapes": sorted(list(parameter.shape) for parameter in self.params),
                    "episode_limit": meter.episode_limit,
                    "threads": torch.get_num_threads(),
                    "optimiser": type(self.optimiser).__name__.lower(),
                    "torch": torch.__version__,
                    "mackrl": _native.CODE,
                }
            )

        def train(self, *arguments):
            super().train(*arguments)
            meter.updates += 1

    return MeteredLearner


if __name__ == "__main__":
    main()
