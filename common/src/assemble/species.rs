//! Names for the species of files that do not say which they hold.

use std::path::{Component, Path};

/// A name for each of some files: without folder and ending, where that tells them apart; else with the ending and as
/// many folders as it takes. Files that are one and the same get one name.
pub(super) fn names(files: &[&Path]) -> Vec<String> {
    let short: Vec<String> = files.iter().map(|file| stem(file)).collect();
    let named = |nth: usize| {
        let is_like = |&k: &usize| k != nth && short[k] == short[nth];
        let others = (0..files.len()).filter(is_like).map(|k| files[k]);
        let others: Vec<&Path> = others.collect();
        if others.is_empty() {
            short[nth].clone()
        } else {
            longer(files[nth], &others)
        }
    };
    (0..files.len()).map(named).collect()
}

/// The end of a path that no other has; where there is none, its last part.
fn longer(file: &Path, others: &[&Path]) -> String {
    let depth = parts(file).len();
    let end = |path: &Path, n: usize| {
        let parts = parts(path);
        parts[parts.len().saturating_sub(n)..].join("/")
    };
    let is_own = |&n: &usize| others.iter().all(|other| end(other, n) != end(file, n));
    let n = (1..=depth).find(is_own).unwrap_or(1);
    end(file, n)
}

/// Folders and name, without what leads nowhere.
fn parts(path: &Path) -> Vec<String> {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::CurDir | Component::RootDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => drop(parts.pop()),
            _ => parts.push(part),
        }
    }
    let text = |part: Component<'_>| part.as_os_str().to_string_lossy().into_owned();
    parts.into_iter().map(text).collect()
}

fn stem(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let plain = match name
        .len()
        .checked_sub(3)
        .map(|at| name.split_at_checked(at))
    {
        Some(Some((plain, ending))) if ending.eq_ignore_ascii_case(".gz") => plain,
        _ => &name,
    };
    let stem = Path::new(plain).file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_apart_by_the_shortest_name() {
        for (files, expected) in [
            (&["plots/oak.obj"][..], &["oak"][..]),
            (&["a/oak.obj.gz", "b/elm.v2.OBJ"], &["oak", "elm.v2"]),
            (&["oak.obj", "oak.obj.gz"], &["oak.obj", "oak.obj.gz"]),
            (
                &["p/a/oak.obj", "p/b/oak.obj", "p/elm.obj"],
                &["a/oak.obj", "b/oak.obj", "elm"],
            ),
            (
                &["a/p/oak.obj", "b/p/oak.obj"],
                &["a/p/oak.obj", "b/p/oak.obj"],
            ),
            (&["oak.obj", "p/oak.obj"], &["oak.obj", "p/oak.obj"]),
            // one and the same
            (&["oak.obj", "./p/../oak.obj"], &["oak.obj", "oak.obj"]),
            (&["../oak.obj", "/oak.obj"], &["../oak.obj", "oak.obj"]),
            (&[""], &[""]),
        ] {
            let files: Vec<&Path> = files.iter().map(Path::new).collect();
            assert_eq!(names(&files), expected);
        }
    }
}
