mod world;
fn main() {}
