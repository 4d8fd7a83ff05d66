//! Learning of action values from remembered episodes: what IQL, VDN and QMIX have in common.
//!
//! They differ in their [`Mixer`](crate::critics::Mixer) alone: IQL compares each agent's value with a target of its own, VDN and
//! QMIX one value of the team, mixed from the agents'. What is like PyMARL (Samvelyan and others, 2019):
//! 1. recurrent agents that share a network and read their observation, their identity and their last action;
//! 2. ε-greedy exploration, ε falling linearly with environment steps; greedy tests;
//! 3. a memory of whole episodes, from which a minibatch is drawn after each batch of new ones, without replacement;
//! 4. double Q: the present networks say which action is next, the target networks what it is worth;
//! 5. target networks refreshed after a number of episodes; at a time limit the value of what follows counts;
//! 6. dead agents take part: their network's value of the only action is mixed as any other;
//! 7. the mean over the steps of a minibatch (IQL: and over agents), one optimiser for agents and mixer, `RMSprop` with ε = 1e-5
//!    outside the root.
//!
//! What is not: nothing is padded, and choices are drawn by name, so that each agent alone reproduces its own.

mod acting;
mod choice;
mod kind;
mod learner;
mod loss;
mod minibatch;
mod settings;

pub use acting::ActionValues;
pub use kind::{Decomposition, ValueDecomposition};
pub use learner::QLearner;
pub use settings::QLearningSettings;
