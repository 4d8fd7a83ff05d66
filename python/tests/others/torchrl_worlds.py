"""TorchRL's wrapper of PettingZoo: its own check of specs, and rollouts that end when the battle does."""

from importlib.metadata import version

import torch
from torchrl.envs import PettingZooWrapper, check_env_specs

from mackrl.pettingzoo import parallel_env


def main() -> None:
    for masks in ("observation", "info"):
        env = PettingZooWrapper(parallel_env("3m", masks=masks), use_mask=False)
        check_env_specs(env)
        rollout = env.rollout(200)
        last = rollout["next", "agent"]
        steps = rollout.shape[0]
        # The dead stay: no agent ends before the others, whatever it died of.
        done = last["terminated"][..., 0] | last["truncated"][..., 0]
        assert not done[:-1].any() and done[-1].all(), done
        names = sorted(str(key) for key in last.keys(True, True))
        if masks == "observation":
            assert any("battle_won" in name for name in names), names
        assert torch.isfinite(last["reward"]).all()
        print(f"masks={masks}: {steps} steps, keys of an agent: {names}")
    print("torchrl", version("torchrl"), "torch", torch.__version__)


if __name__ == "__main__":
    main()
