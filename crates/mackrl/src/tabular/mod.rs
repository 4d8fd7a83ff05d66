//! The matrix game's learners with exact gradients (Figure 5).
//!
//! The game has ten deals and 25 joint actions, so the expected return of a policy is a finite sum and its gradient has a
//! closed form: nothing is sampled, and what Figure 5 compares is *optimisation* alone. That matters for reading it. The best
//! decentralised policy earns as much as the best MACKRL policy at every probability of common knowledge ([`optima`] finds
//! both by enumeration), so wherever MACKRL is ahead it is because joint control of what is commonly known leaves fewer poor
//! local optima, not because it can represent more.
//!
//! The three learners are one [`Policy`] with parts masked: independent actor-critic (IAC) always delegates, joint-action
//! learning (JAL) never does. They are kept apart from the networks on purpose: with 128 parameters in `f64` they are an
//! oracle for the rest of the crate and depend on none of it.

mod game;
mod optimum;
mod policy;
mod sweep;
mod training;

pub use game::TabularGame;
pub use optimum::{Optima, optima};
pub use policy::{
    Gradient, Learner, Logits, PARAMETERS, Policy, expected_return, expected_return_and_gradient,
    joint_probability,
};
pub use sweep::{Curve, Sweep, SweepSettings, sweep};
pub use training::{LEARNING_RATE, Run, UPDATES, train};
