//! Who holds a key: a name and a role, as the certificate has them.

use std::fmt;
use std::str::FromStr;

use armor_wire::acting::KeyRole;
use armor_wire::name::is_name;

/// The scheme of the URI in a certificate.
const SCHEME: &str = "armor://";
/// The name of the role of a robot's host.
const HOST: &str = "host";

/// What a key is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum KeyPurpose {
    /// The gate on a robot's host proves with it that it is that gate.
    Host,
    /// A person connects to gates.
    Person(KeyRole),
}

/// The holder of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyHolder {
    /// The name of the person or of the host.
    pub name: String,
    /// What the key is for.
    pub purpose: KeyPurpose,
}

impl KeyHolder {
    /// The URI that a certificate contains, such as `armor://operator/alice`.
    pub fn to_uri(&self) -> String {
        format!("{SCHEME}{}/{}", self.purpose, self.name)
    }

    /// Reads such a URI; `None` if it is another one.
    pub fn from_uri(uri: &str) -> Option<Self> {
        let (purpose, name) = uri.strip_prefix(SCHEME)?.split_once('/')?;
        let purpose = purpose.parse().ok()?;
        is_name(name).then(|| Self { name: name.to_owned(), purpose })
    }
}

impl fmt::Display for KeyHolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name, self.purpose)
    }
}

impl fmt::Display for KeyPurpose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Host => f.write_str(HOST),
            Self::Person(role) => role.fmt(f),
        }
    }
}

impl FromStr for KeyPurpose {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        if text == HOST {
            return Ok(Self::Host);
        }
        let role = text.parse().map(Self::Person);
        role.map_err(|_| "a role is observer, operator, engineer or host".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_holder_is_read_back_from_its_uri() {
        let roles = KeyRole::ALL.into_iter().map(KeyPurpose::Person);
        for purpose in roles.chain([KeyPurpose::Host]) {
            let holder = KeyHolder { name: "alice-2".into(), purpose };
            assert_eq!(KeyHolder::from_uri(&holder.to_uri()), Some(holder));
        }
        let uri = KeyHolder { name: "robot".into(), purpose: KeyPurpose::Host }.to_uri();
        assert_eq!(uri, "armor://host/robot");
    }

    #[test]
    fn another_uri_is_no_holder() {
        for uri in [
            "",
            "https://operator/alice",
            "armor://operator",
            "armor://operator/",
            "armor://operator/alice/x",
            "armor://operator/al ice",
            "armor://Operator/alice",
            "armor://root/alice",
            "armor:///alice",
        ] {
            assert_eq!(KeyHolder::from_uri(uri), None, "{uri}");
        }
    }
}
