//! The controllers of pairwise MACKRL and the sampler that walks down them.
