//! The inputs that are kept for each fuzz target, in `fuzz/corpus/TARGET/`. Ordinary tests run each of
//! them; a fuzzer begins with them. With `ARMOR_BLESS=1` a test adds what it makes and is not there yet.

use std::fs;
use std::path::{Path, PathBuf};

/// Longest input that is kept, in bytes, and the most of one target: all of them are in the repository.
const MAX_LEN: usize = 16 << 10;
const MAX_TARGET_LEN: usize = 128 << 10;

/// Runs the kept inputs of a target. `make` makes those that are to be there.
pub fn run_corpus(target: &str, run: fn(&[u8]), make: impl FnOnce() -> Vec<Vec<u8>>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = folder.ancestors().map(|it| it.join("fuzz/corpus")).find(|it| it.is_dir());
    let folder = folder.expect("the repository has fuzz/corpus").join(target);
    if std::env::var_os("ARMOR_BLESS").is_some() {
        keep_inputs(&folder, make());
    }
    let inputs = read_inputs(&folder);
    assert!(!inputs.is_empty(), "{} has no input: ARMOR_BLESS=1 adds some", folder.display());
    let len: usize = inputs.iter().map(|(_, input)| input.len()).sum();
    assert!(len <= MAX_TARGET_LEN, "{}: {len} bytes, at most {MAX_TARGET_LEN}", folder.display());
    for (path, input) in inputs {
        assert!(input.len() <= MAX_LEN, "{}: at most {MAX_LEN} bytes", path.display());
        let ran = std::panic::catch_unwind(|| run(&input));
        assert!(ran.is_ok(), "{target} panics with {}", path.display());
    }
}

fn read_inputs(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(path).expect("it is read"))).collect()
}

fn keep_inputs(folder: &Path, new: Vec<Vec<u8>>) {
    fs::create_dir_all(folder).expect("a folder");
    let mut kept: Vec<Vec<u8>> = read_inputs(folder).into_iter().map(|(_, input)| input).collect();
    for input in new.into_iter().filter(|input| input.len() <= MAX_LEN) {
        if !kept.contains(&input) {
            let path = folder.join(format!("{:03}", kept.len()));
            fs::write(path, &input).expect("it is written");
            kept.push(input);
        }
    }
}
