//! One command for each figure of the paper.

pub(crate) mod figure5;
pub(crate) mod meter;

pub(crate) use meter::Meter;
