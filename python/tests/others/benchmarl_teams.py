"""BenchMARL: MAPPO and QMIX train on a task of 40 lines."""

from __future__ import annotations

import tempfile
from importlib.metadata import version

from benchmarl.algorithms import MappoConfig, QmixConfig
from benchmarl.environments import Task, TaskClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.data import Composite
from torchrl.envs import PettingZooWrapper

from mackrl.pettingzoo import parallel_env


class Battle(TaskClass):
    """A map as a task."""

    def get_env_fun(self, num_envs, continuous_actions, seed, device):
        name = self.config["map_name"]
        return lambda: PettingZooWrapper(parallel_env(name), seed=seed, device=device, categorical_actions=True, return_state=True)

    def supports_continuous_actions(self):
        return False

    def supports_discrete_actions(self):
        return True

    def has_render(self, env):
        return False

    def max_steps(self, env):
        return 60

    def group_map(self, env):
        return env.group_map

    def state_spec(self, env):
        return Composite({"state": env.observation_spec["state"].clone()})

    def action_mask_spec(self, env):
        return self.only("action_mask", env)

    def observation_spec(self, env):
        return self.only("observation", env)

    def only(self, name, env):
        """What the groups observe under this name."""
        spec = env.observation_spec.clone()
        for group in self.group_map(env):
            for key in list(spec[group].keys()):
                if key != name:
                    del spec[group, key]
        del spec["state"]
        return spec

    def info_spec(self, env):
        return None

    def action_spec(self, env):
        return env.full_action_spec

    @staticmethod
    def env_name():
        return "mackrl"


class Maps(Task):
    """The maps that are tried."""

    THREE_MARINES = None

    @staticmethod
    def associated_class():
        return Battle


def main() -> None:
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames, config.evaluation, config.loggers, config.render = 400, False, [], False
    config.on_policy_collected_frames_per_batch = config.off_policy_collected_frames_per_batch = 200
    config.on_policy_minibatch_size = config.off_policy_train_batch_size = 50
    config.off_policy_n_optimizer_steps = config.on_policy_n_minibatch_iters = 2
    config.off_policy_n_envs_per_worker = config.on_policy_n_envs_per_worker = 1
    with tempfile.TemporaryDirectory() as config.save_folder:
        for algorithm in (MappoConfig, QmixConfig):
            model = MlpConfig.get_from_yaml()
            task = Maps.THREE_MARINES.get_task({"map_name": "3m"})
            experiment = Experiment(
                task=task,
                algorithm_config=algorithm.get_from_yaml(),
                model_config=model,
                critic_model_config=MlpConfig.get_from_yaml(),
                seed=0,
                config=config,
            )
            experiment.run()
            print(algorithm.__name__, "frames", experiment.total_frames)
            assert experiment.total_frames >= 400
    print("benchmarl", version("benchmarl"), "torchrl", version("torchrl"))


if __name__ == "__main__":
    main()
