//! Partitions of a team into pairs with at most one singleton.
