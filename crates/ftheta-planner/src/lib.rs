//! From vectors to mirror motion and laser edges on one tick grid, and to the words sent.
