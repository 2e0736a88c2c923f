//! A digital twin of a galvo machine: blocks in, the beam that they make out.
