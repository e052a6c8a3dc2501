//! The project of a component in Python: a script, its test and a README.

use std::fs::{self, Permissions};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

const SCRIPT: &str = include_str!("script/component.py.txt");
const TEST: &str = include_str!("script/test.py.txt");
const README: &str = include_str!("script/README.md.txt");

/// Modules of Python that the package `armor`, or most components, import, and words that cannot name
/// one: a script of such a name would be imported in their place.
const TAKEN: &[&str] = &[
    "abc",
    "and",
    "argparse",
    "array",
    "as",
    "ast",
    "asyncio",
    "atexit",
    "assert",
    "async",
    "await",
    "base64",
    "bisect",
    "builtins",
    "calendar",
    "class",
    "cmath",
    "code",
    "codecs",
    "collections",
    "contextlib",
    "continue",
    "copy",
    "csv",
    "ctypes",
    "dataclasses",
    "datetime",
    "decimal",
    "def",
    "del",
    "dis",
    "elif",
    "else",
    "enum",
    "errno",
    "except",
    "faulthandler",
    "finally",
    "for",
    "fractions",
    "from",
    "functools",
    "gc",
    "global",
    "glob",
    "gzip",
    "hashlib",
    "heapq",
    "html",
    "http",
    "if",
    "import",
    "in",
    "inspect",
    "io",
    "is",
    "itertools",
    "json",
    "keyword",
    "lambda",
    "linecache",
    "locale",
    "logging",
    "math",
    "mmap",
    "multiprocessing",
    "nonlocal",
    "not",
    "none",
    "numbers",
    "numpy",
    "operator",
    "or",
    "os",
    "pass",
    "pathlib",
    "pickle",
    "platform",
    "pprint",
    "queue",
    "raise",
    "random",
    "re",
    "return",
    "sched",
    "secrets",
    "select",
    "selectors",
    "shlex",
    "shutil",
    "signal",
    "site",
    "socket",
    "sqlite3",
    "ssl",
    "stat",
    "statistics",
    "string",
    "struct",
    "subprocess",
    "symtable",
    "sys",
    "tempfile",
    "test",
    "textwrap",
    "threading",
    "time",
    "timeit",
    "token",
    "tokenize",
    "trace",
    "traceback",
    "try",
    "types",
    "typing",
    "unittest",
    "uuid",
    "venv",
    "warnings",
    "wave",
    "weakref",
    "while",
    "with",
    "xml",
    "yield",
    "zlib",
];

/// The name of the script, without `.py`.
pub fn module_name(name: &str) -> String {
    name.replace('-', "_")
}

/// Whether a script of this name could not be imported, or would hide a module of Python.
pub fn is_taken(name: &str) -> bool {
    TAKEN.contains(&module_name(name).as_str())
}

/// Writes the files.
///
/// # Errors
/// If one cannot be written.
pub fn write_files(folder: &Path, name: &str, type_name: &str) -> io::Result<()> {
    let module = module_name(name);
    let fill = |text: &str| {
        let text = text.replace("{{name}}", name).replace("{{module}}", &module);
        text.replace("{{Type}}", type_name)
    };
    fs::create_dir_all(folder)?;
    let script = folder.join(format!("{module}.py"));
    fs::write(&script, fill(SCRIPT))?;
    fs::set_permissions(&script, Permissions::from_mode(0o755))?;
    fs::write(folder.join(format!("test_{module}.py")), fill(TEST))?;
    fs::write(folder.join("README.md"), fill(README))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    #[test]
    fn the_script_can_be_executed_and_nothing_is_left_to_fill_in() {
        let scratch = ScratchFolder::new("new-python");
        write_files(scratch.path(), "wall-follower", "WallFollower").expect("written");
        let script = scratch.path().join("wall_follower.py");
        assert_eq!(script.metadata().expect("it exists").permissions().mode() & 0o111, 0o111);
        for file in ["wall_follower.py", "test_wall_follower.py", "README.md"] {
            let text = fs::read_to_string(scratch.path().join(file)).expect("it exists");
            assert!(!text.contains("{{"), "{file}: {text}");
        }
        let text = fs::read_to_string(script).expect("it exists");
        assert!(text.contains("class WallFollower(") && text.contains("kind = \"wall-follower\""));
    }

    #[test]
    fn a_name_that_would_hide_a_module_of_python_is_taken() {
        assert!(is_taken("random") && is_taken("class") && is_taken("none"));
        assert!(!is_taken("wall-follower"));
    }
}
