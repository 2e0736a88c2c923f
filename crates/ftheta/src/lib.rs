//! Open software that moves laser beams with galvanometer mirrors.
