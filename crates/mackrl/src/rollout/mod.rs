//! Episodes of parallel environments, stored once for the learner.
