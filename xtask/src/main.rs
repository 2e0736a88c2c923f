//! The project chores: ci, tidy, test, figures.
fn main() {}
