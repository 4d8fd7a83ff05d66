//! The critic V(state, last actions) and the returns that it learns from.
