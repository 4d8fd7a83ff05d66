//! The matrix game of the paper: two agents, five actions, one step.
