//! Scripts of Python: the interpreter that runs one, and why it did not describe itself: what it lacks, how
//! that is installed, and the line of an exception.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Longest #! line that is read, in bytes; the kernel reads fewer.
const MAX_SHEBANG_LEN: u64 = 512;
/// How much of a script is read for the packages that it names, in bytes: they are at its beginning.
const MAX_HEAD_LEN: u64 = 8 << 10;
/// The package of components, which is not installed from an index.
const OWN_PACKAGE: &str = "armor";

/// What the Python of a script lacks.
#[derive(Debug, PartialEq, Eq)]
pub enum MissingPart<'a> {
    /// The module does not exist.
    Module(&'a str),
    /// The module exists, and has no such name: it is of another version.
    Name { name: &'a str, module: &'a str },
}

/// Returns what the exception in the last line of a traceback reports as missing.
pub fn find_missing_part(last_words: &str) -> Option<MissingPart<'_>> {
    let until_quote = |text: &'_ str| text.split_once('\'').map(|(before, _)| before.len());
    if let Some(named) = last_words.strip_prefix("ModuleNotFoundError: No module named '") {
        return until_quote(named).map(|len| MissingPart::Module(&named[..len]));
    }
    let (name, rest) =
        last_words.strip_prefix("ImportError: cannot import name '")?.split_once("' from '")?;
    until_quote(rest).map(|len| MissingPart::Name { name, module: &rest[..len] })
}

impl MissingPart<'_> {
    /// What is wrong with the script at `path`.
    pub fn describe(&self, path: &Path) -> String {
        let interpreter = find_interpreter(path);
        let interpreter = interpreter.as_deref().unwrap_or("the one of its #! line");
        match self {
            Self::Module(module) => format!("its Python, {interpreter}, has no module `{module}`"),
            Self::Name { name, module } => format!(
                "its Python, {interpreter}, has a module `{module}` without `{name}`: another \
                 version than the script needs"
            ),
        }
    }

    /// What to do about it: the command that installs the packages that the script names, if it does.
    pub fn propose_install(&self, path: &Path) -> String {
        let packages = read_packages(path);
        let (Self::Module(module) | Self::Name { module, .. }) = self;
        let is_own = module.split('.').next() == Some(OWN_PACKAGE);
        if packages.is_empty() || is_own {
            return "activate the environment that has it before `armor` is started (`. \
                    .venv/bin/activate`), or install it there with pip; docs/python.md shows how the \
                    package `armor` is installed"
                .into();
        }
        let python = find_interpreter(path).unwrap_or_else(|| "python3".into());
        let quoted: Vec<_> = packages.iter().map(|package| format!("'{package}'")).collect();
        format!(
            "install what the script names: {python} -m pip install {}; or activate the environment \
             that has it before `armor` is started (`. .venv/bin/activate`)",
            quoted.join(" ")
        )
    }
}

/// The packages that a script names in its block `# /// script` (PEP 723), without Armor's own.
fn read_packages(path: &Path) -> Vec<String> {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(MAX_HEAD_LEN).read_to_end(&mut head));
    if read.is_err() {
        return Vec::new();
    }
    let packages = parse_packages(&String::from_utf8_lossy(&head));
    packages.into_iter().filter(|package| is_installable(package)).collect()
}

/// Whether it is a requirement that a shell takes between single quotes, and not Armor's own package.
fn is_installable(package: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || " ._-[]<>=!~,;()\"".contains(c);
    let name = package.split(|c: char| !(c.is_ascii_alphanumeric() || "._-".contains(c))).next();
    package.starts_with(|c: char| c.is_ascii_alphanumeric())
        && package.chars().all(is_plain)
        && name != Some(OWN_PACKAGE)
}

/// The texts of the list `dependencies` in the block `# /// script` of a script.
fn parse_packages(script: &str) -> Vec<String> {
    let lines = script.lines().skip_while(|line| line.trim_end() != "# /// script").skip(1);
    let block = lines.take_while(|line| line.starts_with('#') && line.trim_end() != "# ///");
    let block: Vec<_> = block.map(|line| line[1..].trim()).collect();
    let begin = block.iter().position(|line| {
        line.strip_prefix("dependencies").is_some_and(|rest| rest.trim_start().starts_with('='))
    });
    let Some(begin) = begin else { return Vec::new() };
    let text = block[begin..].join("\n");
    let Some((_, list)) = text.split_once('[') else { return Vec::new() };
    let mut packages = Vec::new();
    let mut rest = list;
    while let Some(at) = rest.find(['"', '\'', ']', '#']) {
        let mark = &rest[at..=at];
        let after = &rest[at + 1..];
        let end = match mark {
            "]" => break,
            "#" => "\n",
            quote => quote,
        };
        let Some((inside, left)) = after.split_once(end) else { break };
        if mark != "#" {
            packages.push(inside.to_owned());
        }
        rest = left;
    }
    packages
}

/// The interpreter that the #! line of a script leads to: of `/usr/bin/env NAME` the first one in PATH.
pub fn find_interpreter(path: &Path) -> Option<String> {
    let mut head = Vec::new();
    File::open(path).ok()?.take(MAX_SHEBANG_LEN).read_to_end(&mut head).ok()?;
    let head = String::from_utf8_lossy(&head);
    let mut words = head.lines().next()?.strip_prefix("#!")?.split_whitespace();
    let program = words.next()?;
    if !program.ends_with("/env") {
        return Some(program.into());
    }
    let name = words.find(|word| !word.starts_with('-'))?;
    let folders = std::env::var_os("PATH")?;
    let found = std::env::split_paths(&folders).map(|folder| folder.join(name));
    found.into_iter().find(|file| file.is_file()).map(|file| file.display().to_string())
}

/// The file and line of Python that an exception is at, as `file:line`: the last ones of the traceback
/// that are in the folder of the script.
pub fn find_exception_place(complaint: &[u8], script: &Path) -> Option<String> {
    let text = String::from_utf8_lossy(complaint);
    let folder = script.parent().unwrap_or(script);
    let mut places = text.lines().filter_map(|line| {
        let (file, rest) = line.trim().strip_prefix("File \"")?.split_once("\", line ")?;
        let line = rest.split(',').next()?.trim();
        line.parse::<u32>().ok().filter(|_| Path::new(file).starts_with(folder))?;
        Some(format!("{file}:{line}"))
    });
    places.next_back()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_packages_of_a_script_are_those_of_its_block() {
        let check = |script: &str, expected: &[&str]| {
            assert_eq!(parse_packages(script), expected, "{script}");
        };
        let block = "#!/usr/bin/env python3\n# /// script\n# requires-python = \">=3.9\"\n\
                     # dependencies = [\n#   \"armor\",  # \"its own\"\n#   'a[b]<5',\n# ]\n# ///\n";
        check(block, &["armor", "a[b]<5"]);
        check("# /// script\n# dependencies = [\"x\"]\n# ///\n# \"y\"\n", &["x"]);
        check("# /// script\n# dependencies=['x', \"y\"]\nimport x\n", &["x", "y"]);
        check("# /// script\n# dependencies = [\"x\n# ///\n", &[]);
        check("# /// script\n# other = [\"x\"]\n# ///\n", &[]);
        check("# dependencies = [\"x\"]\nimport y\n", &[]);
    }

    #[test]
    fn only_requirements_are_proposed_for_a_shell() {
        for package in ["opencv-python-headless<5", "a[b]>=1,!=2", "c; python_version<\"3.9\""] {
            assert!(is_installable(package), "{package}");
        }
        for package in ["armor", "armor>=1", "a'; rm x", "-r file", "$(x)", "", "a\nb"] {
            assert!(!is_installable(package), "{package}");
        }
    }

    #[test]
    fn a_missing_name_is_another_version() {
        let found = find_missing_part("ModuleNotFoundError: No module named 'cv2'");
        assert_eq!(found, Some(MissingPart::Module("cv2")));
        let text = "ImportError: cannot import name 'HOG' from 'cv2' (/x/cv2/__init__.py)";
        let found = find_missing_part(text).expect("it is one");
        assert_eq!(found, MissingPart::Name { name: "HOG", module: "cv2" });
        let described = found.describe(Path::new("/no/such/script"));
        assert!(described.contains("a module `cv2` without `HOG`"), "{described}");
        assert_eq!(find_missing_part("ImportError: libGL.so.1: cannot open"), None);
    }

    #[test]
    fn the_place_of_an_exception_is_the_last_one_in_the_folder_of_the_script() {
        let script = Path::new("/robot/components/arm.py");
        let place = |text: &str| find_exception_place(text.as_bytes(), script);
        let syntax =
            "  File \"/robot/components/arm.py\", line 7\n    def x(\nSyntaxError: '(' ...";
        assert_eq!(place(syntax).as_deref(), Some("/robot/components/arm.py:7"));
        let raised = "Traceback (most recent call last):\n\
                      \x20 File \"/robot/components/arm.py\", line 3, in <module>\n\
                      \x20 File \"/robot/components/grip/hand.py\", line 12, in close\n\
                      \x20 File \"/usr/lib/python3/json/__init__.py\", line 346, in loads\nValueError: x";
        assert_eq!(place(raised).as_deref(), Some("/robot/components/grip/hand.py:12"));
        for other in ["", "error: no port", "  File \"/usr/lib/a.py\", line 3, in f\nKeyError: 'x'"]
        {
            assert_eq!(place(other), None, "{other}");
        }
    }
}
