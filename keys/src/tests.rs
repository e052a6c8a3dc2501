//! Keys from the authority to the verifier, at times that the test chooses.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::acting::KeyRole;
use rustls::pki_types::UnixTime;
use rustls::server::danger::ClientCertVerifier;

use super::folder::{FolderError, KeyState};
use super::*;
use crate::expiry::DAY_S;
use crate::tls::{KeyVerifier, client_config, explain_refused_key, gate_config};

const NOW_S: i64 = 1_800_000_000;
const ALICE: (&str, KeyPurpose) = ("alice", KeyPurpose::Person(KeyRole::Operator));
const ROBOT: (&str, KeyPurpose) = ("robot", KeyPurpose::Host);

fn holder((name, purpose): (&str, KeyPurpose)) -> KeyHolder {
    KeyHolder { name: name.into(), purpose }
}

fn issue(authority: &Authority, who: (&str, KeyPurpose)) -> KeyFile {
    let validity = Validity::days_from(NOW_S, 10);
    KeyFile::from_text(&authority.issue_key(holder(who), validity).unwrap().text).unwrap()
}

/// Why `key` is refused at a time by the gate with the key `gate`.
fn verify(
    gate: &KeyFile,
    key: &KeyFile,
    revoked: &Arc<RevokedKeys>,
    at_s: i64,
) -> Option<&'static str> {
    let verifier = KeyVerifier::new(gate, Arc::clone(revoked)).unwrap();
    let now = UnixTime::since_unix_epoch(Duration::from_secs(at_s.unsigned_abs()));
    let verified = verifier.verify_client_cert(&key.certificate, &[], now);
    verified.err().map(|error| explain_refused_key(&error))
}

#[test]
fn a_key_is_accepted_in_its_time_and_by_gates_of_its_authority() {
    let (ours, other) = (Authority::create(NOW_S).unwrap(), Authority::create(NOW_S).unwrap());
    let (gate, alice) = (issue(&ours, ROBOT), issue(&ours, ALICE));
    let revoked = Arc::default();
    let end_s = NOW_S + 10 * DAY_S;
    assert_eq!(alice.facts.not_after_s, end_s);
    for (at_s, refused) in [
        (NOW_S, None),
        (NOW_S - DAY_S, None),
        (NOW_S - DAY_S - 1, Some("its key is not valid yet by this host's clock")),
        (end_s, None),
        (end_s + 1, Some("its key has expired")),
    ] {
        assert_eq!(verify(&gate, &alice, &revoked, at_s), refused, "at {at_s}");
    }
    let mallory = issue(&other, ALICE);
    let refused = verify(&gate, &mallory, &revoked, NOW_S);
    assert_eq!(refused, Some("another authority has made its key"));
}

#[test]
fn a_revoked_key_is_refused_and_its_renewal_is_not() {
    let authority = Authority::create(NOW_S).unwrap();
    let gate = issue(&authority, ROBOT);
    let (old, new) = (issue(&authority, ALICE), issue(&authority, ALICE));
    let revoked = Arc::<RevokedKeys>::default();
    revoked.add_keys([old.facts.serial.clone()]);
    assert_eq!(verify(&gate, &old, &revoked, NOW_S), Some("its key is revoked"));
    assert_eq!(verify(&gate, &new, &revoked, NOW_S), None);
}

#[test]
fn a_host_connects_to_others_and_is_no_person() {
    let authority = Authority::create(NOW_S).unwrap();
    let (gate, other) = (issue(&authority, ROBOT), issue(&authority, ROBOT));
    assert_eq!(verify(&gate, &other, &Arc::default(), NOW_S), None);
    assert_eq!(other.facts.role(), None);
}

#[test]
fn the_role_is_in_the_certificate() {
    let authority = Authority::create(NOW_S).unwrap();
    for role in KeyRole::ALL {
        let key = issue(&authority, ("bob", KeyPurpose::Person(role)));
        assert_eq!((key.facts.role(), key.facts.holder.name.as_str()), (Some(role), "bob"));
    }
    assert_eq!(issue(&authority, ROBOT).facts.role(), None);
}

#[test]
fn an_authority_is_read_back_and_a_secret_is_not_printed() {
    let authority = Authority::create(NOW_S).unwrap();
    let again = Authority::from_text(&authority.to_text()).unwrap();
    let (gate, alice) = (issue(&authority, ROBOT), issue(&again, ALICE));
    assert_eq!(verify(&gate, &alice, &Arc::default(), NOW_S), None);
    let debug = format!("{alice:?}");
    assert!(debug.contains("alice") && !debug.contains("key:") && debug.len() < 400, "{debug}");
    let text = authority.issue_key(holder(ALICE), Validity::days_from(NOW_S, 1)).unwrap().text;
    assert!(Authority::from_text(&text).is_err_and(|error| error.contains("armor keys init")));
    let error = KeyFile::from_text(&authority.to_text()).unwrap_err();
    assert!(error.contains("armor keys add"), "{error}");
    for at in (0..text.len()).step_by(37) {
        // A file that was cut is an error, or lacks nothing.
        if let Ok(key) = KeyFile::from_text(&text[..at]) {
            gate_config(&key, Arc::default()).unwrap();
        }
    }
}

#[test]
fn a_key_file_with_the_secret_of_another_is_refused() {
    let authority = Authority::create(NOW_S).unwrap();
    let (mut alice, bob) = (issue(&authority, ALICE), issue(&authority, ALICE));
    alice.key = bob.key.clone_key();
    assert!(client_config(&alice).is_err() && gate_config(&alice, Arc::default()).is_err());
    assert!(client_config(&bob).is_ok());
}

#[test]
fn no_key_lasts_longer_than_its_authority() {
    let authority = Authority::create(NOW_S).unwrap();
    let validity = Validity::days_from(NOW_S, 21 * 365);
    let error = authority.issue_key(holder(ALICE), validity).err().unwrap();
    assert!(error.contains("choose fewer days"), "{error}");
    assert!(authority.issue_key(holder(("a b", ROBOT.1)), Validity::days_from(NOW_S, 1)).is_err());
}

#[test]
fn a_folder_keeps_what_was_made_and_revoked() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("keys");
    let states = |folder: &KeysFolder, now_s| -> Vec<_> {
        let keys = folder.list_keys(now_s).unwrap();
        keys.into_iter().map(|key| (key.facts.holder.name, key.state)).collect()
    };
    assert!(KeysFolder::open(&path).unwrap_err().to_string().contains("armor keys init"));
    let folder = KeysFolder::create(&path, NOW_S).unwrap();
    let added = folder.add_key(holder(ALICE), 10, NOW_S).unwrap();
    for file in ["authority.key", "issued", "revoked", "alice.key"] {
        let mode = fs::metadata(path.join(file)).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "{file}");
    }
    assert_eq!(KeyFile::load(&added.path).unwrap().facts, added.facts);
    let error = folder.add_key(holder(ALICE), 10, NOW_S).unwrap_err().to_string();
    assert!(error.contains("armor keys renew alice"), "{error}");
    let renewed = folder.renew_key("alice", &[], 20, NOW_S).unwrap();
    assert_ne!(renewed.facts.serial, added.facts.serial);
    assert_eq!(KeyFile::load(&added.path).unwrap().facts, renewed.facts);
    folder.add_key(holder(ROBOT), 1, NOW_S).unwrap();
    drop(folder);
    assert!(KeysFolder::create(&path, NOW_S).unwrap_err().to_string().contains("already"));
    let folder = KeysFolder::open(&path).unwrap();
    assert_eq!(folder.revoke_keys("alice", NOW_S).unwrap(), [added.facts, renewed.facts]);
    let (alice, robot) = (|state| ("alice".to_owned(), state), |state| ("robot".to_owned(), state));
    let revoked = KeyState::Revoked;
    assert_eq!(
        states(&folder, NOW_S + 5 * DAY_S),
        [alice(revoked), alice(revoked), robot(KeyState::Expired)]
    );
    for (name, words) in [("alice", "is revoked already"), ("eve", "there are: alice, robot")] {
        let error = folder.revoke_keys(name, NOW_S).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let error = folder.renew_key("alice", &[], 1, NOW_S).unwrap_err().to_string();
    assert!(error.contains("armor keys add alice --role operator"), "{error}");
    folder.add_key(holder(ALICE), 1, NOW_S).unwrap();
    assert_eq!(states(&folder, NOW_S).last(), Some(&alice(KeyState::Valid)));
    let sites = ["robot.local", "192.168.0.7"].map(|site| site.parse().unwrap()).to_vec();
    let robot_key = folder.renew_key("robot", &sites, 1, NOW_S).unwrap();
    let renewed = folder.renew_key("robot", &[], 1, NOW_S).unwrap();
    for (key, whose) in [(robot_key, "given"), (renewed, "kept by a renewal")] {
        assert_eq!(key.facts.sites, sites, "{whose}");
        assert_eq!(KeyFile::load(&key.path).unwrap().facts.sites, sites, "{whose}");
    }
    assert_eq!(folder.list_keys(NOW_S).unwrap().last().unwrap().facts.sites, sites);
    let own = folder.add_key(holder(("authority", ROBOT.1)), 1, NOW_S).unwrap_err().to_string();
    assert!(own.contains("the authority's own file"), "{own}");
}

#[test]
fn a_browser_verifies_the_page_by_the_names_in_the_key_of_the_host() {
    use rustls::client::WebPkiServerVerifier;
    use rustls::client::danger::ServerCertVerifier;
    use rustls::pki_types::ServerName;

    let authority = Authority::create(NOW_S).unwrap();
    let sites = ["robot.local", "192.168.0.7", "fd00::7"].map(|site| site.parse().unwrap());
    let key = NewKey { holder: holder(ROBOT), sites: sites.to_vec() };
    let text = authority.issue_key(key, Validity::days_from(NOW_S, 1)).unwrap().text;
    let robot = KeyFile::from_text(&text).unwrap();
    assert_eq!(robot.facts.sites, sites);
    let mut roots = rustls::RootCertStore::empty();
    roots.add(robot.authority.clone()).unwrap();
    let ring = Arc::new(rustls::crypto::ring::default_provider());
    let browser =
        WebPkiServerVerifier::builder_with_provider(Arc::new(roots), ring).build().unwrap();
    let now = UnixTime::since_unix_epoch(Duration::from_secs(NOW_S.unsigned_abs()));
    for (name, is_accepted) in [
        ("robot.local", true),
        ("192.168.0.7", true),
        ("fd00::7", true),
        ("other.local", false),
        ("192.168.0.8", false),
    ] {
        let name = ServerName::try_from(name).unwrap();
        let verified = browser.verify_server_cert(&robot.certificate, &[], &name, &[], now);
        assert_eq!(verified.is_ok(), is_accepted, "{name:?}");
    }
    let alice = NewKey { holder: holder(ALICE), sites: sites.to_vec() };
    let refused = authority.issue_key(alice, Validity::days_from(NOW_S, 1)).err().unwrap();
    assert!(refused.contains("--at"), "{refused}");
}

#[test]
fn a_key_or_folder_that_others_can_read_is_refused_with_the_remedy() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("keys");
    let folder = KeysFolder::create(&path, NOW_S).unwrap();
    let key = folder.add_key(holder(ALICE), 10, NOW_S).unwrap().path;
    drop(folder);
    let set_mode = |path: &std::path::Path, mode| {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    };
    for mode in [0o640, 0o604, 0o620] {
        set_mode(&key, mode);
        let error = KeyFile::load(&key).unwrap_err().to_string();
        assert!(error.contains("chmod 600") && error.contains("revoke"), "{error}");
    }
    set_mode(&path.join("authority.key"), 0o644);
    let folder = KeysFolder::open(&path).unwrap();
    let error = folder.add_key(holder(ROBOT), 10, NOW_S).unwrap_err().to_string();
    assert!(error.contains("authority.key") && error.contains("chmod 600"), "{error}");
    drop(folder);
    set_mode(&path, 0o755);
    let error = KeysFolder::open(&path).unwrap_err();
    assert!(matches!(error, FolderError::File(KeyFileError::Open { .. })), "{error}");
    assert!(error.to_string().contains("chmod 700"), "{error}");
}
