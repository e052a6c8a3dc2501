//! What the processes of a run prove to each other: that the launcher has started them.
//!
//! A run has one secret. From it each name has its own key, which its process gets in its environment.
//! A process proves its key with a code over its hello, so that neither secret nor key is sent. The
//! registry, which has the secret, admits only such a process under a name of the run; a component
//! compares the proof of an executive or a launcher with its own key.
//!
//! A link that another host asks for has a key as well. The registry, which knows the links of the file,
//! gives it to the processes of the host that may read the data; the component that provides them derives
//! it from its own key, and so compares what the registry has decided without asking it.
//!
//! The code is SipHash-2-4 with 128 bits (Aumasson, Bernstein: *SipHash: a fast short-input PRF*, 2012).

use std::fmt;
use std::str::FromStr;

use siphasher::sip128::SipHasher24;

use crate::codec;
use crate::hello::Hello;
pub use crate::limits::KEY_LEN;

/// The secret of a run. Its text is hexadecimal.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct RunSecret([u8; KEY_LEN]);

/// The key of one name of a run. Its text is hexadecimal.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct NameKey([u8; KEY_LEN]);

/// The key with which the processes of one other host read the data of one process start.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct LinkKey(NameKey);

impl RunSecret {
    /// The secret of these random bytes.
    pub fn new(bytes: [u8; KEY_LEN]) -> Self {
        Self(bytes)
    }

    /// Returns the key of a component or a daemon.
    pub fn key_of(&self, name: &str) -> NameKey {
        NameKey(authenticate(&self.0, name.as_bytes()))
    }
}

impl NameKey {
    /// Adds the proof to a hello, which must not change after that.
    pub fn prove(&self, hello: &mut Hello) {
        hello.proof = None;
        hello.proof = self.code_of(hello);
    }

    /// Returns whether the sender of the hello has this key.
    pub fn verify(&self, hello: &Hello) -> bool {
        let Some(proof) = hello.proof else { return false };
        let expected = self.code_of(&Hello { proof: None, ..hello.clone() });
        // Each byte is compared, so that the time reveals none.
        let differs = |expected: [u8; KEY_LEN]| {
            expected.iter().zip(proof).fold(0, |differs, (a, b)| differs | (a ^ b))
        };
        expected.is_some_and(|expected| differs(expected) == 0)
    }

    /// Returns the key of the links over which the holder of this key, in the process start `instance`,
    /// sends `data` to the processes of another host.
    pub fn key_of_link(&self, host: &str, data: &str, instance: u64) -> LinkKey {
        // Neither name contains a line break, and no hello begins like this.
        let text = format!("link\n{host}\n{data}\n{instance}");
        LinkKey(Self(authenticate(&self.0, text.as_bytes())))
    }

    /// None for a hello that cannot be sent.
    fn code_of(&self, hello: &Hello) -> Option<[u8; KEY_LEN]> {
        Some(authenticate(&self.0, &codec::encode(hello).ok()?))
    }
}

impl LinkKey {
    /// The key of these bytes, as the registry has sent them.
    pub fn new(bytes: [u8; KEY_LEN]) -> Self {
        Self(NameKey(bytes))
    }

    /// Returns its bytes, for the registry's answer.
    pub fn to_bytes(self) -> [u8; KEY_LEN] {
        self.0.0
    }

    /// Adds the proof to the hello of a link, which must not change after that.
    pub fn prove(&self, hello: &mut Hello) {
        self.0.prove(hello);
    }

    /// Returns whether the sender of the hello has this key.
    pub fn verify(&self, hello: &Hello) -> bool {
        self.0.verify(hello)
    }
}

fn authenticate(key: &[u8; KEY_LEN], bytes: &[u8]) -> [u8; KEY_LEN] {
    SipHasher24::new_with_key(key).hash(bytes).as_bytes()
}

fn write_hex(bytes: [u8; KEY_LEN], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    write!(f, "{:032x}", u128::from_be_bytes(bytes))
}

fn read_hex(text: &str) -> Result<[u8; KEY_LEN], String> {
    let is_hex = text.len() == 2 * KEY_LEN && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let number = u128::from_str_radix(text, 16).ok().filter(|_| is_hex);
    number.map(u128::to_be_bytes).ok_or_else(|| "32 hexadecimal digits are expected".into())
}

impl fmt::Display for RunSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_hex(self.0, f)
    }
}

impl fmt::Display for NameKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_hex(self.0, f)
    }
}

impl FromStr for RunSecret {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        read_hex(text).map(Self)
    }
}

impl FromStr for NameKey {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        read_hex(text).map(Self)
    }
}

// Neither belongs into a log.
impl fmt::Debug for RunSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RunSecret(…)")
    }
}

impl fmt::Debug for NameKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("NameKey(…)")
    }
}

impl fmt::Debug for LinkKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LinkKey(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Role;
    use crate::hello::Purpose;

    fn hello(from: &str) -> Hello {
        Hello::new(from, 7, Purpose::Control { role: Role::Executive })
    }

    #[test]
    fn a_proof_is_valid_for_its_key_and_its_hello_only() {
        let (secret, other) = (RunSecret::new([1; KEY_LEN]), RunSecret::new([2; KEY_LEN]));
        let key = secret.key_of("driver");
        let mut proven = hello("executive");
        assert!(!key.verify(&proven), "without a proof");
        key.prove(&mut proven);
        assert!(key.verify(&proven));
        for wrong in [secret.key_of("planner"), other.key_of("driver")] {
            assert!(!wrong.verify(&proven));
        }
        for changed in [
            Hello { instance: 8, ..proven.clone() },
            Hello { from: "planner".into(), ..proven.clone() },
            Hello { purpose: Purpose::Control { role: Role::Launcher }, ..proven.clone() },
            Hello { proof: Some([0; KEY_LEN]), ..proven.clone() },
        ] {
            assert!(!key.verify(&changed), "{changed:?}");
        }
    }

    #[test]
    fn the_key_of_a_link_is_good_for_one_provider_host_data_and_process_start() {
        let secret = RunSecret::new([1; KEY_LEN]);
        let key = secret.key_of("laser").key_of_link("arm", "laser.scan", 7);
        let mut proven = hello("planner");
        LinkKey::new(key.to_bytes()).prove(&mut proven);
        assert!(key.verify(&proven));
        let laser = secret.key_of("laser");
        for other in [
            secret.key_of("camera").key_of_link("arm", "laser.scan", 7),
            laser.key_of_link("base", "laser.scan", 7),
            laser.key_of_link("arm", "laser.state", 7),
            laser.key_of_link("arm", "laser.scan", 8),
        ] {
            assert!(!other.verify(&proven));
        }
        assert!(!laser.verify(&proven), "it is no proof of the name");
    }

    #[test]
    fn a_key_is_read_from_its_text_and_is_in_no_log() {
        let secret: RunSecret = "000102030405060708090a0b0c0d0e0f".parse().expect("a secret");
        assert_eq!(secret.to_string(), "000102030405060708090a0b0c0d0e0f");
        let key = secret.key_of("driver");
        assert_eq!(key.to_string().parse(), Ok(key));
        assert!(!format!("{secret:?}{key:?}").contains("0001"));
        for wrong in
            ["", "00", "+00102030405060708090a0b0c0d0e0f", "g00102030405060708090a0b0c0d0e0f"]
        {
            assert!(wrong.parse::<RunSecret>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_code_is_that_of_the_reference() {
        // The first vectors of the reference implementation (vectors_sip128): the key 00 … 0f, and the
        // messages of no byte and of one byte, 00.
        let key: [u8; KEY_LEN] = std::array::from_fn(|at| at as u8);
        let hex = |bytes: [u8; KEY_LEN]| NameKey(bytes).to_string();
        assert_eq!(hex(authenticate(&key, &[])), "a3817f04ba25a8e66df67214c7550293");
        assert_eq!(hex(authenticate(&key, &[0])), "da87c1d86b99af44347659119b22fc45");
    }
}
