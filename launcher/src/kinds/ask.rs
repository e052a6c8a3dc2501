//! Asks many executables at once, and those that are what they were not at all.

use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;

use armor_wire::manifest::Manifest;

use super::cache::{Cache, Identity};
use super::probe::{self, Problem};

/// Executables asked at once: they start, print and end, and some wait for their disk.
const AT_ONCE: usize = 8;

/// An executable, and what came of asking it.
pub type Answer = (PathBuf, Result<Manifest, Problem>);

/// The manifest of each executable, or what is wrong with it, in the same order.
pub fn all(executables: Vec<PathBuf>, cache: &Cache) -> Vec<Answer> {
    if executables.is_empty() {
        return Vec::new();
    }
    let known = cache.load();
    let fresh = Mutex::new(Vec::new());
    let answers: Vec<Mutex<Option<Result<Manifest, Problem>>>> =
        executables.iter().map(|_| Mutex::new(None)).collect();
    let next = Mutex::new(executables.iter().zip(&answers));
    let ask = || {
        let identity = |path| Identity::of(path).ok();
        // A binding of its own, so that the lock is not held while asking.
        while let Some((path, answer)) = { next.lock().ok().and_then(|mut next| next.next()) } {
            let before = identity(path);
            let remembered = before.as_ref().and_then(|identity| known.get(path, identity));
            let told = remembered.unwrap_or_else(|| {
                if let Some(identity) = &before {
                    identity.settle();
                }
                let told = probe::describe(path);
                // Only what can be told from its next version, and was not replaced meanwhile.
                // Any other problem is found again at once, and may lie elsewhere.
                let lasting = match &told {
                    Ok(manifest) => Some(Some(manifest.clone())),
                    Err(problem) => (*problem == Problem::hangs()).then_some(None),
                };
                if let (Some(lasting), Some(before)) = (lasting, before)
                    && identity(path).as_ref() == Some(&before)
                    && let Ok(mut fresh) = fresh.lock()
                {
                    fresh.push((path.clone(), before, lasting));
                }
                told
            });
            if let Ok(mut answer) = answer.lock() {
                *answer = Some(told);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..AT_ONCE.min(executables.len()) {
            scope.spawn(ask);
        }
    });
    cache.keep(fresh.into_inner().unwrap_or_default());
    let answers = answers.into_iter().map(|answer| answer.into_inner().ok().flatten());
    executables
        .iter()
        .zip(answers)
        .map(|(path, answer)| (path.clone(), answer.unwrap_or_else(|| Err(Problem::unasked()))))
        .collect()
}
