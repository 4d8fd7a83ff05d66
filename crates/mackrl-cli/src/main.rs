//! The `mackrl` program.
fn main() {}
