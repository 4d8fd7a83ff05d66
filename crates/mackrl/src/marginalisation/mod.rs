//! The probability of a joint action over all paths through the hierarchy (eq. 5) and its gradient.
