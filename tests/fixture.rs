//! What every whole-system test needs: a folder of its own, and `armor` started in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A folder for one test, removed when the test is over. Its runs are not seen by others.
pub struct Folder(PathBuf);

impl Folder {
    /// An empty folder for the test called `name`.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("armor-system-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder for the test");
        Self(path)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file into it.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("writable");
        path
    }

    /// `armor` with `arguments`, in this folder and with nothing of the surroundings.
    pub fn armor(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_armor"));
        command.args(arguments).current_dir(&self.0).stdin(Stdio::null());
        command.env("XDG_RUNTIME_DIR", self.0.join("run"));
        for variable in ["ARMOR_REGISTRY", "ARMOR_COMPONENTS", "ARMOR_OUT", "ARMOR_LOG"] {
            command.env_remove(variable);
        }
        command
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs a command to its end: code, stdout, stderr.
pub fn ended(command: &mut Command) -> (i32, String, String) {
    let Output { status, stdout, stderr } = command.output().expect("armor starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("armor prints UTF-8");
    (status.code().expect("it ends by itself"), text(stdout), text(stderr))
}
