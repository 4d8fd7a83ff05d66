#!/usr/bin/env python3
"""Plays SMAC's own client on the stand-in and writes down what it observes, for comparison with the simulator.

    cargo build --release
    python3 scripts/sc2/parity.py --smac PATH/TO/smac [--maps 3m,MMM] [--episodes 2] [--out DIR]

PATH/TO/smac is a clone of the SMAC repository (https://github.com/oxwhirl/smac); it is not on the Python package index, where
`smac` is something else. What it needs (pysc2, s2clientprotocol, an old protobuf) is installed into a virtual environment below
--out. One file a map is written; then a test plays the same actions in the simulator and compares every observation, state,
availability, reward and end, to 1e-6.
"""

import argparse
import base64
import gzip
import json
import os
import pathlib
import subprocess
import sys
import venv

PACKAGES = ["protobuf<3.21", "pysc2", "s2clientprotocol", "absl-py", "numpy", "pygame"]
ROOT = pathlib.Path(__file__).resolve().parents[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smac", type=pathlib.Path, required=True, help="clone of the SMAC repository")
    parser.add_argument("--maps", default="all", help="maps to play, separated by commas")
    parser.add_argument("--episodes", type=int, default=2, help="episodes of each map, in one game")
    parser.add_argument("--seed", type=int, default=5, help="seed of the game and of the choices")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target" / "sc2-parity")
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target" / "release" / "mackrl")
    parser.add_argument("--no-comparison", action="store_true", help="only write the files")
    arguments = parser.parse_args()
    if not (arguments.smac / "smac" / "env" / "starcraft2" / "starcraft2.py").is_file():
        sys.exit(f"{arguments.smac} holds no smac/env/starcraft2/starcraft2.py: give --smac the path of a clone of SMAC's repository")
    if not arguments.program.is_file():
        sys.exit(f"{arguments.program} is missing: build it, or give --program")
    arguments.out.mkdir(parents=True, exist_ok=True)
    if os.environ.get("MACKRL_PARITY_INSIDE") is None:
        sys.exit(run_inside(arguments))
    play_all(arguments)


def run_inside(arguments):
    """Runs this script again by a Python that has what SMAC needs."""
    folder = arguments.out / "venv"
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    game = arguments.out / "game"
    subprocess.run([arguments.program, "sc2", "install", game], check=True, stdout=subprocess.DEVNULL)
    environment = {**os.environ, "SC2PATH": str(game), "PYTHONPATH": str(arguments.smac), "MACKRL_PARITY_INSIDE": "1"}
    played = subprocess.run([python, *sys.argv], env=environment).returncode
    if played != 0 or arguments.no_comparison:
        return played
    compare = ["cargo", "test", "--package", "mackrl-sc2", "recorded_client", "--", "--include-ignored"]
    return subprocess.run(compare, cwd=ROOT, env={**os.environ, "MACKRL_SC2_CLIENT": str(arguments.out.resolve())}).returncode


def play_all(arguments):
    sys.argv = sys.argv[:1]
    from absl import flags

    flags.FLAGS(sys.argv)
    from smac.env.starcraft2.maps import smac_maps

    known = list(smac_maps.get_smac_map_registry())
    names = known if arguments.maps == "all" else arguments.maps.split(",")
    for name in names:
        if name not in known:
            sys.exit(f"no map is called {name}, expected one of {', '.join(known)}")
        file = arguments.out / f"{name}.jsonl.gz"
        lines = play(name, arguments.seed, arguments.episodes)
        with gzip.GzipFile(file, "wb", compresslevel=9, mtime=0) as out:
            for line in lines:
                out.write((json.dumps(line, separators=(",", ":")) + "\n").encode())
        print(f"{file}: {len(lines) - 1} observations, {file.stat().st_size} bytes", file=sys.stderr)


def play(name, seed, episodes):
    """Everything that the client of one map observes, and every message that it sends."""
    import numpy
    import websocket
    from smac.env import StarCraft2Env

    exchanges = []
    send, receive = websocket.WebSocket.send, websocket.WebSocket.recv

    def listen(self, payload, opcode=websocket.ABNF.OPCODE_TEXT):
        if opcode in (websocket.ABNF.OPCODE_TEXT, websocket.ABNF.OPCODE_BINARY):
            exchanges.append([base64.b64encode(payload).decode()])
        return send(self, payload, opcode)

    def listen_back(self):
        payload = receive(self)
        exchanges[-1].append(base64.b64encode(payload).decode())
        return payload

    websocket.WebSocket.send, websocket.WebSocket.recv = listen, listen_back
    choices = numpy.random.RandomState(seed)
    game = StarCraft2Env(map_name=name, seed=seed)
    lines = []
    for episode in range(episodes):
        game.reset()
        lines.append({"episode": episode, **shown(game)})
        end = False
        while not end:
            actions = [choose(choices, available) for available in game.get_avail_actions()]
            reward, end, info = game.step(actions)
            won = bool(info.get("battle_won", False))
            lines.append({"actions": actions, "reward": float(reward), "end": bool(end), "won": won, **shown(game)})
    restarts = game.force_restarts
    game.close()
    websocket.WebSocket.send, websocket.WebSocket.recv = send, receive
    assert restarts == 0, f"{name}: the client had to restart the game {restarts} times"
    return [{"map": name, "seed": seed, "exchanges": exchanges}, *lines]


def choose(choices, available):
    """Any available action; one with a target, if there is one, half of the time."""
    open_ = [action for action, is_open in enumerate(available) if is_open]
    targets = [action for action in open_ if action >= 6]
    if targets and choices.rand() < 0.5:
        open_ = targets
    return int(choices.choice(open_))


def shown(game):
    numbers = lambda array: [float(f"{number:.9g}") for number in array]
    return {
        "observations": [numbers(row) for row in game.get_obs()],
        "state": numbers(game.get_state()),
        "available": ["".join(str(int(bit)) for bit in row) for row in game.get_avail_actions()],
    }


if __name__ == "__main__":
    main()
