//! Style as a test: layers, sizes, descriptions, words.

use std::fs;
use std::path::{Path, PathBuf};

/// What each crate may see of the others, dev-dependencies included.
const LAYERS: [(&str, &[&str]); 10] = [
    ("ftheta-model", &[]),
    ("ftheta-physics", &["ftheta-model"]),
    ("ftheta-formats", &["ftheta-model", "ftheta-physics"]),
    ("ftheta-toolpath", &["ftheta-model", "ftheta-physics"]),
    ("ftheta-planner", &["ftheta-model", "ftheta-physics"]),
    ("ftheta-calibrate", &["ftheta-model", "ftheta-physics"]),
    ("ftheta-twin", &["ftheta-model", "ftheta-physics"]),
    ("ftheta-report", &["ftheta-model", "ftheta-physics"]),
    (
        "ftheta",
        &[
            "ftheta-model",
            "ftheta-physics",
            "ftheta-formats",
            "ftheta-toolpath",
            "ftheta-planner",
            "ftheta-calibrate",
            "ftheta-twin",
            "ftheta-report",
        ],
    ),
    ("ftheta-cli", &["ftheta"]),
];

const LINES_MAX: usize = 500;
const COLUMNS_MAX: usize = 100;
const FILE_BYTES_MAX: u64 = 1 << 20;
const MODULES_BANNED: [&str; 5] = ["utils", "common", "helpers", "misc", "manager"];

/// Runs all checks.
///
/// # Errors
/// Every finding, one a line.
pub fn check(root: &Path) -> Result<(), String> {
    let mut findings = Vec::new();
    layers(root, &mut findings);
    let mut files = Vec::new();
    for folder in ["crates", "xtask", "gallery"] {
        list(&root.join(folder), &mut files);
    }
    files.sort();
    for path in &files {
        let shown = path.strip_prefix(root).unwrap_or(path).display().to_string();
        if fs::metadata(path).is_ok_and(|data| data.len() > FILE_BYTES_MAX) {
            findings.push(format!("{shown}: larger than 1 MiB"));
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("rs") => source(path, &shown, &mut findings),
            _ if path.ends_with("Cargo.toml") => reasons(path, &shown, &mut findings),
            _ => {}
        }
    }
    if findings.is_empty() { Ok(()) } else { Err(findings.join("\n")) }
}

/// Arrows between crates point down, and each crate says the same sentence in two places.
fn layers(root: &Path, findings: &mut Vec<String>) {
    let Ok(folders) = fs::read_dir(root.join("crates")) else {
        findings.push("crates: cannot be listed".into());
        return;
    };
    for folder in folders.flatten() {
        let name = folder.file_name().to_string_lossy().into_owned();
        let Some((_, allowed)) = LAYERS.iter().find(|(known, _)| *known == name) else {
            findings.push(format!("crates/{name}: has no place in the layers"));
            continue;
        };
        let manifest = read(&folder.path().join("Cargo.toml"));
        for line in manifest.lines() {
            let seen = line.split(['.', ' ', '=']).next().unwrap_or_default();
            if seen.starts_with("ftheta") && !allowed.contains(&seen) {
                findings.push(format!("crates/{name}: must not see {seen}"));
            }
        }
        let sentence = manifest.lines().find_map(|line| line.strip_prefix("description = "));
        let sentence = sentence.unwrap_or_default().trim_matches('"');
        let main = ["src/lib.rs", "src/main.rs"].map(|file| read(&folder.path().join(file)));
        let documented = main.concat();
        if documented.lines().next() != Some(&format!("//! {sentence}")) {
            findings.push(format!("crates/{name}: first line and description differ"));
        }
    }
}

/// Every dependency outside the workspace says why it is there.
fn reasons(path: &Path, shown: &str, findings: &mut Vec<String>) {
    let text = read(path);
    let mut inside = false;
    for line in text.lines() {
        if line.starts_with('[') {
            inside = line.contains("dependencies");
        } else if inside
            && line.contains(" = ")
            && !line.contains("workspace = true")
            && !line.contains("#")
        {
            findings.push(format!("{shown}: no reason given for {line}"));
        }
    }
}

fn source(path: &Path, shown: &str, findings: &mut Vec<String>) {
    let text = read(path);
    let n_lines = text.lines().count();
    if n_lines > LINES_MAX {
        findings.push(format!("{shown}: {n_lines} lines, limit {LINES_MAX}"));
    }
    if !text.starts_with("//! ") {
        findings.push(format!("{shown}: does not begin with a sentence about itself"));
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if MODULES_BANNED.contains(&stem.as_str()) {
        findings.push(format!("{shown}: a name that says nothing"));
    }
    // This file names the words it looks for.
    if shown.ends_with("xtask/src/tidy.rs") {
        return;
    }
    for (index, line) in text.lines().enumerate() {
        let at = format!("{shown}:{}", index + 1);
        // Golden text and messages may be as long as they are.
        if line.chars().count() > COLUMNS_MAX && !line.contains('"') && !line.contains('|') {
            findings.push(format!("{at}: more than {COLUMNS_MAX} columns"));
        }
        for word in ["FIXME", "XXX", "#[ignore", "should_panic", "/work/", "/root/"] {
            if line.contains(word) {
                findings.push(format!("{at}: contains {word}"));
            }
        }
    }
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            if !path.ends_with("target") {
                list(&path, files);
            }
        } else {
            files.push(path);
        }
    }
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}
