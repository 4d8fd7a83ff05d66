"""Steps a CPU second of SMAX (JaxMARL), jitted, with random available actions: `python smax.py 3m 64`."""

from __future__ import annotations

import sys
import time

import jax
import jax.numpy as jnp
from jaxmarl import make
from jaxmarl.environments.smax import map_name_to_scenario

map_name, worlds = sys.argv[1], int(sys.argv[2])
env = make("HeuristicEnemySMAX", scenario=map_name_to_scenario(map_name))
LENGTH = 100


def step(carry, _):
    state, observed, key = carry
    key, of_actions, of_step = jax.random.split(key, 3)
    available = jax.vmap(env.get_avail_actions)(state)
    keys = jax.random.split(of_actions, len(env.agents))
    actions = {
        name: jax.random.categorical(one, jnp.where(available[name] > 0, 0.0, -jnp.inf))
        for name, one in zip(env.agents, keys)
    }
    observed, state, reward, done, _ = jax.vmap(env.step)(jax.random.split(of_step, worlds), state, actions)
    # Everything is read, so that nothing is optimised away.
    read = sum(jnp.sum(one) for one in jax.tree.leaves((observed, reward, available)))
    return (state, observed, key), read


@jax.jit
def play(carry):
    carry, read = jax.lax.scan(step, carry, None, LENGTH)
    return carry, read.sum()


observed, state = jax.vmap(env.reset)(jax.random.split(jax.random.PRNGKey(0), worlds))
carry = (state, observed, jax.random.PRNGKey(1))
for _ in range(3):
    # What comes out has types that what goes in first may not have: it is compiled twice.
    carry, _ = jax.block_until_ready(play(carry))
played, start = 0, time.process_time()
while (spent := time.process_time() - start) < 3:
    carry, _ = jax.block_until_ready(play(carry))
    played += LENGTH * worlds
print(played / spent)
