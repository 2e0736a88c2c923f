//! From shapes to vectors in order: flatten, hatch, clip, and the shortest way round.
