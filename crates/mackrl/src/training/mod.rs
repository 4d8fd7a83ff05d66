//! The training loop: rollout, learner, tests and metrics.
