//! The matrix game's learners with exact gradients (Figure 5).
