//! What a group of agents commonly knows, and the features that its controller reads of it.
//!
//! A fact is common knowledge in a group if everybody knows it, everybody knows that everybody knows it, and so on for
//! ever. Where sight is a matter of geometry that all agents know, this tower collapses: a group in which all see each
//! other commonly knows exactly what all of them see, and any other group nothing (Lemma 1, eq. (3)). [`common_knowledge`]
//! is the lemma on bit sets; [`common_knowledge_from_view`] is what one member can compute alone and the reason why
//! nothing need be communicated; [`recursion`] is the tower itself (eqs. (1) and (2)), kept to test the other two.
//!
//! [`GroupEncoder`] turns commonly known entities into the inputs and the action mask of the group's controller. It is
//! given those entities and nothing else, so all members compute the same bits.

mod encoder;
mod lemma;
pub mod recursion;

pub use encoder::{CommonKnowledgeFeatures, GroupEncoder, joint_mask};
pub use lemma::{common_knowledge, common_knowledge_from_view};

#[cfg(test)]
mod tests;
