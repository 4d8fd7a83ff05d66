//! What acting and learning share: the tables of one step's log-probabilities.
