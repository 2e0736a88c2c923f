//! Checks that everything we link has a licence from the list in `deny.toml`.

use std::path::Path;
use std::process::Command;

/// Checks the licence of every package in the tree of normal dependencies.
///
/// # Errors
/// The packages whose licence is not on the list.
pub fn check(root: &Path) -> Result<(), String> {
    let deny = std::fs::read_to_string(root.join("deny.toml"))
        .map_err(|error| format!("deny.toml: {error}"))?;
    let allowed: Vec<&str> = deny
        .lines()
        .skip_while(|line| !line.starts_with("allow = ["))
        .skip(1)
        .take_while(|line| !line.starts_with(']'))
        .filter_map(|line| line.split('"').nth(1))
        .collect();
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--workspace", "--edges", "normal", "--prefix", "none"])
        .args(["--format", "{p}\t{l}"])
        .current_dir(root)
        .output()
        .map_err(|error| format!("cannot run cargo tree: {error}"))?;
    if !output.status.success() {
        return Err(format!("cargo tree failed: {}", String::from_utf8_lossy(&output.stderr)));
    }
    let mut refused: Vec<String> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| line.trim_end_matches(" (*)").split_once('\t'))
        .filter(|(package, licence)| !package.contains("(/") && !is_allowed(licence, &allowed))
        .map(|(package, licence)| format!("{package}: licence \"{licence}\" is not in deny.toml"))
        .collect();
    refused.sort();
    refused.dedup();
    if refused.is_empty() { Ok(()) } else { Err(refused.join("\n")) }
}

/// Whether one alternative of an SPDX expression has only licences of the list.
fn is_allowed(expression: &str, allowed: &[&str]) -> bool {
    expression.replace(['(', ')'], "").replace('/', " OR ").split(" OR ").any(|alternative| {
        alternative.split(" AND ").all(|licence| allowed.contains(&licence.trim()))
    })
}

#[cfg(test)]
mod tests {
    use super::is_allowed;

    #[test]
    fn alternatives_and_conjunctions() {
        let allowed = ["MIT", "Zlib"];
        assert!(is_allowed("MIT OR GPL-3.0", &allowed));
        assert!(is_allowed("(MIT OR Apache-2.0) AND Zlib", &allowed));
        assert!(!is_allowed("GPL-3.0", &allowed));
        assert!(!is_allowed("MIT AND GPL-3.0", &allowed));
        assert!(!is_allowed("", &allowed));
    }
}
