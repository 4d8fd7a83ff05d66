//! Sets of entities as bits of one word.
//!
//! The largest game has 66 entities, so 128 bits hold every set: an intersection is one instruction, sets are `Copy`, and
//! iteration is in ascending order, which determinism needs.

use serde::{Deserialize, Serialize};

use crate::EntityId;

/// A set of entities, each below [`EntitySet::CAPACITY`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct EntitySet(u128);

impl EntitySet {
    /// Number of entities that a set can tell apart.
    pub const CAPACITY: usize = 128;
    /// The set without members.
    pub const EMPTY: Self = Self(0);

    /// The set {0, …, `count` − 1}.
    ///
    /// # Panics
    /// If `count` exceeds [`Self::CAPACITY`].
    #[must_use]
    pub const fn first(count: usize) -> Self {
        assert!(
            count <= Self::CAPACITY,
            "an entity set holds at most 128 entities"
        );
        if count == Self::CAPACITY {
            Self(u128::MAX)
        } else {
            Self((1 << count) - 1)
        }
    }

    /// The set whose members are the bits of `bits`, lowest first.
    #[must_use]
    pub const fn from_bits(bits: u128) -> Self {
        Self(bits)
    }

    /// The members as bits, entity 0 lowest.
    #[must_use]
    pub const fn bits(self) -> u128 {
        self.0
    }

    /// Whether `entity` is a member.
    #[must_use]
    pub fn contains(self, entity: impl Into<EntityId>) -> bool {
        let index = entity.into().index();
        index < Self::CAPACITY && self.0 >> index & 1 == 1
    }

    /// Adds `entity`.
    ///
    /// # Panics
    /// If the entity's index is not below [`Self::CAPACITY`].
    pub fn insert(&mut self, entity: impl Into<EntityId>) {
        let index = entity.into().index();
        assert!(
            index < Self::CAPACITY,
            "an entity set holds at most 128 entities"
        );
        self.0 |= 1 << index;
    }

    /// Number of members.
    #[must_use]
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether there are no members.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Members of both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Members of either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Members of this set that are not in `other`.
    #[must_use]
    pub const fn difference(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether every member is in `other`.
    #[must_use]
    pub const fn is_subset_of(self, other: Self) -> bool {
        self.0 & !other.0 == 0
    }

    /// Members in ascending order.
    pub fn iter(self) -> impl Iterator<Item = EntityId> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            if rest == 0 {
                return None;
            }
            let lowest = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            Some(EntityId::new(lowest))
        })
    }
}

impl<E: Into<EntityId>> FromIterator<E> for EntitySet {
    fn from_iter<I: IntoIterator<Item = E>>(entities: I) -> Self {
        let mut set = Self::EMPTY;
        entities.into_iter().for_each(|entity| set.insert(entity));
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_come_back_in_ascending_order() {
        let set: EntitySet = [5, 127, 0, 64].map(EntityId::new).into_iter().collect();
        assert_eq!(
            set.iter().map(EntityId::index).collect::<Vec<_>>(),
            [0, 5, 64, 127]
        );
        assert_eq!(set.len(), 4);
    }

    #[test]
    fn the_first_n_entities_are_exactly_those_below_n() {
        assert!(EntitySet::first(0).is_empty());
        assert_eq!(EntitySet::first(128).len(), 128);
        assert!(EntitySet::first(7).contains(EntityId::new(6)));
        assert!(!EntitySet::first(7).contains(EntityId::new(7)));
    }
}
