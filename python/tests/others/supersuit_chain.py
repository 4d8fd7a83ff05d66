"""SuperSuit's chain from a parallel world to a vector environment, which copies worlds with cloudpickle."""

from importlib.metadata import version

import numpy as np
import supersuit

from mackrl.pettingzoo import parallel_env


def main() -> None:
    env = supersuit.black_death_v3(parallel_env("3m", masks="info", dead="leave"))
    vector = supersuit.concat_vec_envs_v1(supersuit.pettingzoo_env_to_vec_env_v1(env), 2, base_class="gymnasium")
    vector.reset(seed=1)
    for _ in range(150):
        actions = np.array([vector.action_space.sample() for _ in range(vector.num_envs)])
        observations, *_ = vector.step(actions)
    assert observations.shape == (6, 30)
    print("supersuit", version("supersuit"), "observations", observations.shape)


if __name__ == "__main__":
    main()
