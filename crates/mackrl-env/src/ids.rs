//! Names for agents, entities and actions, so that one index cannot be taken for another.

use serde::{Deserialize, Serialize};

macro_rules! index_newtype {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(
            Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
        )]
        #[serde(transparent)]
        pub struct $name(u16);

        impl $name {
            /// Names the element at `index`.
            ///
            /// # Panics
            /// If `index` exceeds `u16::MAX`; every environment here is far smaller.
            #[must_use]
            pub fn new(index: usize) -> Self {
                Self(u16::try_from(index).expect("ids are below 65 536"))
            }

            /// Position in arrays whose axis runs over these ids.
            #[must_use]
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                self.0.fmt(formatter)
            }
        }
    };
}

index_newtype!(
    /// One of the N agents. Agent i is also entity i.
    AgentId
);
index_newtype!(
    /// One of the M entities: the agents first, then everything else that can be seen.
    EntityId
);
index_newtype!(
    /// One of the A actions of an agent.
    Action
);

impl From<AgentId> for EntityId {
    fn from(agent: AgentId) -> Self {
        Self(agent.0)
    }
}
