//! Thousands of damaged files for every decoder: each gets an answer, and none a panic.

#[path = "../../../fuzz/kept_corpus.rs"]
mod kept_corpus;

use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use armor_hostile::damage::damage_one;
use armor_hostile::entry::DECODERS;
use armor_hostile::fuzzing::{FuzzOptions, fuzz_all, list_targets};
use armor_hostile::seeds::make_seeds;
use fastrand::Rng;

/// Inputs of each decoder; under `ARMOR_FULL` so many times as many.
const INPUTS: u64 = 3_000;
const FULL: u64 = 100;

fn folder_of(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("hostile-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn check(name: &str) {
    let (_, decode) = DECODERS.into_iter().find(|(own, _)| *own == name).expect("a decoder");
    let folder = folder_of(name);
    let seeds = make_seeds(name, &folder).expect("seeds");
    seeds.iter().for_each(|seed| decode(seed));
    let seed = std::env::var("ARMOR_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    println!("seed {seed}; ARMOR_SEED={seed} makes the same inputs again");
    let count = if std::env::var_os("ARMOR_FULL").is_some() { FULL * INPUTS } else { INPUTS };
    for number in 0..count {
        let input = damage_one(&seeds, &mut Rng::with_seed(seed ^ (number << 20)));
        if std::panic::catch_unwind(|| decode(&input)).is_err() {
            let path = folder.join(format!("{seed}-{number}"));
            std::fs::write(&path, &input).expect("it is written");
            panic!("{name}: input {number} of seed {seed} is in {}", path.display());
        }
    }
}

/// The program, with all decoders for one second together, and where it keeps what it finds.
fn fuzz_briefly(program: &Path, name: &str, only: Option<&str>) -> (anyhow::Result<u64>, PathBuf) {
    let found = folder_of(name);
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let (time, only) = (Duration::from_secs(1), only.map(ToOwned::to_owned));
    let options = FuzzOptions { time, seed: 7, only, found: found.clone(), corpus };
    (fuzz_all(program, &options), found)
}

#[test]
fn every_decoder_has_its_share_of_the_time() {
    let targets: BTreeSet<_> = list_targets().iter().map(|(name, _)| (*name).to_owned()).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/fuzz_targets");
    let files = std::fs::read_dir(folder).expect("the targets").filter_map(Result::ok);
    let files = files.filter_map(|file| Some(file.path().file_stem()?.to_str()?.to_owned()));
    assert_eq!(targets, files.collect(), "the decoders, and the targets of the fuzzer");
    let program = Path::new(env!("CARGO_BIN_EXE_armor-hostile"));
    let (tried, found) = fuzz_briefly(program, "fuzzed", None);
    assert!(tried.expect("every decoder survives") >= targets.len() as u64);
    assert_eq!(std::fs::read_dir(found).expect("a folder").count(), 0, "nothing is left");
}

/// A program in the place of this one ends as a decoder would that an input kills.
#[test]
fn an_input_that_ends_the_process_is_kept_and_named() {
    let folder = folder_of("killer");
    let program = folder.join("killer.sh");
    // The sixth argument is the file of the current input.
    let script = "#!/bin/sh\nprintf 'a\\001b' > \"$6\"\nkill -SEGV $$\n";
    std::fs::write(&program, script).expect("it is written");
    let mode = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(&program, mode).expect("it may run");
    let (tried, found) = fuzz_briefly(&program, "killed", Some("worlds"));
    let why = tried.expect_err("it has not survived").to_string();
    assert!(why.contains("worlds did not survive an input of seed 7"), "{why}");
    let kept: Vec<_> = std::fs::read_dir(found).expect("a folder").filter_map(Result::ok).collect();
    let [kept] = &kept[..] else { panic!("one input: {kept:?}") };
    assert!(kept.file_name().to_string_lossy().starts_with("worlds-7-"), "{kept:?}");
    assert_eq!(std::fs::read(kept.path()).expect("it is kept"), b"a\x01b");
    let (unknown, _) = fuzz_briefly(&program, "unknown", Some("word"));
    assert!(unknown.expect_err("no such decoder").to_string().contains("guards, pnml"));
}

/// Damaged inputs that are kept of each decoder, next to the well-formed ones.
const KEPT_DAMAGED: usize = 24;
/// Longest of these, in bytes: a short one shows a fault better.
const KEPT_LEN: usize = 2 << 10;

/// What `fuzz/corpus` keeps of a decoder. A secret key is not kept, not even that of a test.
fn make_corpus(name: &str) -> Vec<Vec<u8>> {
    let seeds = make_seeds(name, &folder_of(&format!("corpus-{name}"))).expect("seeds");
    let damaged = (0..1000).map(|number| damage_one(&seeds, &mut Rng::with_seed(number)));
    let damaged = damaged.filter(|input| input.len() <= KEPT_LEN).take(KEPT_DAMAGED);
    let corpus: Vec<Vec<u8>> = seeds.iter().cloned().chain(damaged).collect();
    let has_secret = |input: &Vec<u8>| String::from_utf8_lossy(input).contains("PRIVATE");
    corpus.into_iter().filter(|input| !has_secret(input)).collect()
}

#[test]
fn the_kept_inputs_of_every_decoder_get_an_answer() {
    for (name, decode) in DECODERS {
        kept_corpus::run_corpus(name, decode, || make_corpus(name));
    }
}

/// A seed that no decoder accepts would test nothing but its refusal.
#[test]
fn every_seed_is_well_formed() {
    use armor_executive::journal::verify_bytes;
    let seeds = |name: &str| make_seeds(name, &folder_of(&format!("seeds-{name}"))).expect("seeds");
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
    for seed in seeds("guards") {
        let text = text(&seed);
        let is_read = armor_robotfile::guard::Guard::parse(&text).is_ok()
            || armor_robotfile::claim::Claim::parse(&text).is_ok();
        assert!(is_read, "{text}");
    }
    for seed in seeds("pnml") {
        armor_petri::file::pnml::read(&text(&seed)).expect("a net");
    }
    for seed in seeds("tina") {
        armor_petri::file::tina::read(&text(&seed)).expect("a net");
    }
    for seed in seeds("worlds") {
        armor_simulator::world::World::parse("a.svg", &seed).expect("a world");
    }
    for seed in seeds("logs") {
        let log = armor_carmen_player::log::CarmenLog::new(&seed[..]);
        assert!(log.filter_map(Result::ok).count() > 3, "{}", text(&seed));
    }
    for seed in seeds("journals") {
        let at = seed.iter().position(|byte| *byte == 0).expect("two files");
        let found = verify_bytes(Some(&seed[..at]), Some(&seed[at + 1..])).expect("this format");
        assert_eq!(found.fault, None);
        assert!(found.end.number > 3);
    }
    for seed in seeds("recordings") {
        let path = folder_of("seeds-recordings").join("a.mcap");
        std::fs::write(&path, &seed).expect("it is written");
        let mut recording = armor_recording::Recording::open(&path).expect("a recording");
        let is_whole = recording.summary().is_complete;
        let messages = std::iter::from_fn(|| recording.next_message().expect("whole"));
        let count = messages.filter(|message| message.payload.is_ok()).count();
        assert!(count == 6 || (!is_whole && count > 0), "{count}");
    }
    for (seed, format) in seeds("plans").iter().zip(armor_exchange::PlanFormat::ALL) {
        let plan = armor_exchange::read_plan(&text(seed), *format).expect("a plan");
        let marks = plan.fences.len() + plan.rally_points.len();
        assert!(plan.routes[0].items.len() + marks > 1, "{plan:?}");
    }
    for (seed, extension) in seeds("pictures").iter().zip(armor_hostile::entry::PICTURES) {
        assert!(armor_hostile::entry::is_picture(seed), "{extension}");
    }
    let keys = seeds("keys");
    assert!(armor_keys::revoked::parse_revoked(&text(&keys[0])).is_ok_and(|it| it.len() == 1));
    assert!(armor_keys::KeyFile::from_text(&text(&keys[1])).is_ok());
    let invitations = armor_keys::invitations::Invitations::from_text(&text(&keys[2]));
    assert!(invitations.is_ok_and(|it| it.list().len() == 1));
}

#[test]
fn any_guard_gets_an_answer() {
    check("guards");
}

#[test]
fn any_net_in_pnml_gets_an_answer() {
    check("pnml");
}

#[test]
fn any_net_of_tina_gets_an_answer() {
    check("tina");
}

#[test]
fn any_plan_gets_an_answer() {
    check("plans");
}

#[test]
fn any_picture_gets_an_answer() {
    check("pictures");
}

#[test]
fn any_world_gets_an_answer() {
    check("worlds");
}

#[test]
fn any_log_gets_an_answer() {
    check("logs");
}

#[test]
fn any_journal_gets_an_answer() {
    check("journals");
}

#[test]
fn any_key_gets_an_answer() {
    check("keys");
}

#[test]
fn any_state_gets_an_answer() {
    check("states");
}

#[test]
fn any_recording_gets_an_answer() {
    check("recordings");
}
