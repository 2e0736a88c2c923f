//! Two photographs instead of trial and error: a head with hidden errors and a laser with hidden
//! delays, before and after.
//!
//! `cargo run --release -p ftheta --example 05_two_photographs [SEED]`
#![allow(clippy::unwrap_used, reason = "an example may stop at once")]

#[path = "../tests/two_photographs/mod.rs"]
mod two_photographs;

use ftheta::atlas_store::AtlasStore;
use two_photographs::{Hidden, Quality};

fn main() {
    let seed = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(7);
    let store = AtlasStore::new(None);
    let (hidden, mut known) = Hidden::new(seed);
    let row = |what: &str, Quality { contour_um, ends_um }: Quality| {
        println!(
            "{what:28} square of 100 mm: {contour_um:7.1} µm   ends of lines: {ends_um:6.1} µm"
        );
    };
    println!("machine S14-f420, head and delays hidden by seed {seed}");
    row("as the data sheet says", hidden.mark(&known, &store));
    hidden.tell_delays(&mut known);
    row("after the comb's photograph", hidden.mark(&known, &store));
    hidden.tell_field(&mut known);
    row("after the grid's photograph", hidden.mark(&known, &store));
}
