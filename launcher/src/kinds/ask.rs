//! Asks many executables in parallel, and does not ask those that have not changed.

use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;

use armor_wire::manifest::Manifest;

use super::cache::{Cache, Identity};
use super::probe::{self, ProbeProblem};

/// Executables asked in parallel: they start, print and end, and some wait for their disk.
const AT_ONCE: usize = 8;

/// An executable, and what came of asking it.
pub type ProbeAnswer = (PathBuf, Result<Manifest, ProbeProblem>);

/// Returns the manifest of each executable, or its problem, in the same order.
pub fn ask_executables(executables: Vec<PathBuf>, cache: &Cache) -> Vec<ProbeAnswer> {
    if executables.is_empty() {
        return Vec::new();
    }
    let known = cache.load_entries();
    let fresh = Mutex::new(Vec::new());
    let answers: Vec<Mutex<Option<Result<Manifest, ProbeProblem>>>> =
        executables.iter().map(|_| Mutex::new(None)).collect();
    let next = Mutex::new(executables.iter().zip(&answers));
    let ask = || {
        let identity = |path| Identity::of(path).ok();
        // A binding of its own, so that the lock is not held while asking.
        while let Some((path, answer)) = { next.lock().ok().and_then(|mut next| next.next()) } {
            let before = identity(path);
            let remembered =
                before.as_ref().and_then(|identity| known.find_manifest(path, identity));
            let answer_now = remembered.unwrap_or_else(|| {
                if let Some(identity) = &before {
                    identity.wait_until_settled();
                }
                let answer_now = probe::ask_description(path);
                // Only if its next version can be distinguished, and it was not replaced in the
                // meantime. Any other problem is found again quickly, and may have another cause.
                let lasting = match &answer_now {
                    Ok(manifest) => Some(Some(manifest.clone())),
                    Err(problem) => (*problem == ProbeProblem::hangs()).then_some(None),
                };
                if let (Some(lasting), Some(before)) = (lasting, before)
                    && identity(path).as_ref() == Some(&before)
                    && let Ok(mut fresh) = fresh.lock()
                {
                    fresh.push((path.clone(), before, lasting));
                }
                answer_now
            });
            if let Ok(mut answer) = answer.lock() {
                *answer = Some(answer_now);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..AT_ONCE.min(executables.len()) {
            scope.spawn(ask);
        }
    });
    cache.store_entries(fresh.into_inner().unwrap_or_default());
    let answers = answers.into_iter().map(|answer| answer.into_inner().ok().flatten());
    executables
        .iter()
        .zip(answers)
        .map(|(path, answer)| {
            (path.clone(), answer.unwrap_or_else(|| Err(ProbeProblem::unasked())))
        })
        .collect()
}
