//! Names of things in the open files, interned so that a handle to one is copied like a number.

use std::collections::HashSet;
use std::fmt;
use std::ops::Deref;

use parking_lot::Mutex;

/// Every name that a [`ItemName`] was made of. Entries are never removed: a drawing copies and
/// compares names for each node of each frame, while the distinct names of a session are few and
/// short.
static NAMES: Mutex<Option<HashSet<&'static str>>> = Mutex::new(None);

/// The name of a component, a port, a place, a transition or a variable.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ItemName(&'static str);

impl ItemName {
    /// Returns the handle of this name.
    pub fn new(text: &str) -> Self {
        let mut names = NAMES.lock();
        let names = names.get_or_insert_default();
        match names.get(text) {
            Some(known) => Self(known),
            None => {
                let kept: &'static str = Box::leak(text.into());
                names.insert(kept);
                Self(kept)
            }
        }
    }

    /// Returns the text.
    pub fn as_str(self) -> &'static str {
        self.0
    }
}

impl Deref for ItemName {
    type Target = str;

    fn deref(&self) -> &str {
        self.0
    }
}

impl AsRef<str> for ItemName {
    fn as_ref(&self) -> &str {
        self.0
    }
}

impl fmt::Display for ItemName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.0)
    }
}

impl fmt::Debug for ItemName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.0, f)
    }
}

impl PartialEq<String> for ItemName {
    fn eq(&self, other: &String) -> bool {
        self.0 == other
    }
}

impl PartialEq<str> for ItemName {
    fn eq(&self, other: &str) -> bool {
        self.0 == other
    }
}

impl PartialEq<&str> for ItemName {
    fn eq(&self, other: &&str) -> bool {
        self.0 == *other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_name_is_kept_once() {
        let (one, other) = (ItemName::new("laser"), ItemName::new(&String::from("laser")));
        assert!(std::ptr::eq(one.as_str(), other.as_str()));
        assert!(ItemName::new("a") < ItemName::new("b"));
    }
}
