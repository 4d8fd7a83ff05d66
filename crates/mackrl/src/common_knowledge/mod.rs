//! What a group of agents commonly knows, and the features that its controller reads of it.
