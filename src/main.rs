//! The `trimray` program.

fn main() {}
