//! The numbers of SMAC's actions, said once.

/// What the dead choose, and nobody else.
pub(super) const NO_OPERATION: usize = 0;
/// Stand, and end what was under way.
pub(super) const STOP: usize = 1;
/// Number of the first move.
pub(super) const MOVES_FROM: usize = 2;
/// Where the moves lead: north, south, east, west.
pub(super) const DIRECTIONS: [[f32; 2]; 4] = [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0]];
/// Number of the first action with a target. The i-th is about enemy i or, for healers, about agent i.
pub(super) const TARGETS_FROM: usize = MOVES_FROM + DIRECTIONS.len();
