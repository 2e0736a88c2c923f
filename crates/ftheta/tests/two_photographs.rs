//! Two photographs of a machine with hidden errors and delays, and how well it marks then.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

#[path = "two_photographs/mod.rs"]
mod hidden;

use ftheta::atlas_store::AtlasStore;
use hidden::Hidden;

#[test]
fn two_photographs_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let store = AtlasStore::new(Some(folder.path().into()));
    let (hidden, mut known) = Hidden::new(12);
    let before = hidden.mark(&known, &store);
    assert!(before.contour_um > 1000.0 && before.ends_um > 100.0, "{before:?}");
    hidden.tell_delays(&mut known);
    hidden.tell_field(&mut known);
    let after = hidden.mark(&known, &store);
    assert!(after.contour_um < 25.0 && after.ends_um < 5.0, "{after:?}");
}
