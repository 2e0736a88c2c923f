//! The ftheta command: a drawing in, a marked field out.
fn main() {}
