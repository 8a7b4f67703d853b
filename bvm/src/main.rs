//! The command `bvm`.
fn main() {}
