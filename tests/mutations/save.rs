//! Fifty styles in which people, editors and tools save a file. Each leaves the new text under the
//! same path; some leave other files in the folder as well.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, SystemTime};

use rustix::fs::{CWD, RenameFlags, renameat_with};

/// The path of the file, and a folder for other files.
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// Another folder of the same file system.
    pub elsewhere: PathBuf,
    /// Counts the saves.
    pub n: usize,
}

/// Saves the bytes in the file.
pub type Style = fn(&Place, &[u8]) -> io::Result<()>;

/// Long enough for configd to read a half-written file.
const PAUSE: Duration = Duration::from_millis(60);
/// Time between two pieces of a slow but steady writer.
const STEP: Duration = Duration::from_millis(2);

impl Place {
    /// A file in the same folder.
    fn sibling(&self, name: &str) -> PathBuf {
        self.path.with_file_name(name)
    }

    /// A file in the same folder: the file's name between `before` and `behind`.
    fn named(&self, before: &str, behind: &str) -> PathBuf {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        self.sibling(&format!("{before}{name}{behind}"))
    }

    fn apart(&self) -> PathBuf {
        self.elsewhere.join(format!("version-{}.xml", self.n))
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new("."))
    }

    fn sync_folder(&self) -> io::Result<()> {
        File::open(self.folder())?.sync_all()
    }
}

fn writing(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

fn synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Truncates, then writes pieces of `len` bytes, with a step between them.
fn in_pieces(path: &Path, bytes: &[u8], len: usize, step: Duration) -> io::Result<()> {
    let mut file = File::create(path)?;
    for piece in bytes.chunks(len) {
        file.write_all(piece)?;
        sleep(step);
    }
    Ok(())
}

fn gone(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

fn run(program: &str, arguments: &[&Path]) -> io::Result<()> {
    let status = Command::new(program).args(arguments).status()?;
    if status.success() { Ok(()) } else { Err(io::Error::other(format!("{program}: {status}"))) }
}

/// Runs a shell script; `$1` is a file with the new text, `$2` the file to be saved.
fn shell(place: &Place, bytes: &[u8], script: &str) -> io::Result<()> {
    fs::write(place.apart(), bytes)?;
    run("sh", &["-ec".as_ref(), script.as_ref(), "sh".as_ref(), &place.apart(), &place.path])
}

/// Replaces the path by a link to `target`, atomically.
fn link_over(place: &Place, target: &Path) -> io::Result<()> {
    let new = place.named(".", ".link");
    gone(&new)?;
    symlink(target, &new)?;
    fs::rename(new, &place.path)
}

pub const STYLES: &[(&str, Style)] = &[
    // In place.
    ("truncated and written", |p, b| fs::write(&p.path, b)),
    ("truncated, written, synced", |p, b| synced(&p.path, b)),
    ("written over, then cut", |p, b| {
        let mut file = writing(&p.path)?;
        file.write_all(b)?;
        file.set_len(b.len() as u64)
    }),
    ("cut to its new length, then written over", |p, b| {
        let mut file = writing(&p.path)?;
        file.set_len(b.len() as u64)?;
        file.write_all(b)
    }),
    ("bytes one by one", |p, b| in_pieces(&p.path, b, 1, Duration::ZERO)),
    ("pieces of 64 bytes", |p, b| in_pieces(&p.path, b, 64, Duration::ZERO)),
    ("pieces of 512 bytes", |p, b| in_pieces(&p.path, b, 512, Duration::ZERO)),
    ("pages", |p, b| in_pieces(&p.path, b, 4096, Duration::ZERO)),
    ("a steady trickle", |p, b| in_pieces(&p.path, b, b.len() / 20 + 1, STEP)),
    ("in two halves with a pause", |p, b| in_pieces(&p.path, b, b.len() / 2 + 1, PAUSE)),
    ("in three parts with pauses", |p, b| in_pieces(&p.path, b, b.len() / 3 + 1, PAUSE)),
    ("emptied, a pause, then written", |p, b| {
        fs::write(&p.path, "")?;
        sleep(PAUSE);
        fs::write(&p.path, b)
    }),
    ("the second half first", |p, b| {
        let mut file = File::create(&p.path)?;
        let half = b.len() / 2;
        file.seek(SeekFrom::Start(half as u64))?;
        file.write_all(&b[half..])?;
        file.rewind()?;
        file.write_all(&b[..half])
    }),
    ("synced after every piece", |p, b| {
        let mut file = File::create(&p.path)?;
        for piece in b.chunks(b.len() / 4 + 1) {
            file.write_all(piece)?;
            file.sync_data()?;
        }
        Ok(())
    }),
    ("written through", |p, b| {
        let flags = i32::try_from(rustix::fs::OFlags::SYNC.bits()).map_err(io::Error::other)?;
        let mut file =
            OpenOptions::new().write(true).truncate(true).custom_flags(flags).open(&p.path)?;
        file.write_all(b)
    }),
    ("twice, the first time something else", |p, b| {
        fs::write(&p.path, "<armor")?;
        fs::write(&p.path, b)
    }),
    ("kept open for a while afterwards", |p, b| {
        let mut file = File::create(&p.path)?;
        file.write_all(b)?;
        sleep(PAUSE);
        drop(file);
        Ok(())
    }),
    ("with a time of long ago", |p, b| {
        let mut file = File::create(&p.path)?;
        file.write_all(b)?;
        file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000))
    }),
    ("written and touched", |p, b| {
        fs::write(&p.path, b)?;
        File::open(&p.path)?.set_modified(SystemTime::now())
    }),
    ("written and given another mode", |p, b| {
        fs::write(&p.path, b)?;
        let mode = if p.n.is_multiple_of(2) { 0o600 } else { 0o644 };
        fs::set_permissions(&p.path, fs::Permissions::from_mode(mode))
    }),
    // By programs.
    ("cat >", |p, b| shell(p, b, r#"cat "$1" > "$2""#)),
    ("tee", |p, b| shell(p, b, r#"tee "$2" < "$1" > /dev/null"#)),
    ("cp", |p, b| shell(p, b, r#"cp "$1" "$2""#)),
    ("cp --remove-destination", |p, b| shell(p, b, r#"cp --remove-destination "$1" "$2""#)),
    ("install", |p, b| shell(p, b, r#"install -m 644 "$1" "$2""#)),
    ("dd without truncation", |p, b| {
        shell(p, b, r#"dd if="$1" of="$2" conv=notrunc status=none; truncate -r "$1" "$2""#)
    }),
    ("mv from another folder", |p, b| shell(p, b, r#"mv -f "$1" "$2""#)),
    ("mv --backup", |p, b| shell(p, b, r#"mv --backup=numbered "$1" "$2""#)),
    ("ln -f", |p, b| shell(p, b, r#"ln -f "$1" "$2""#)),
    // Replaced.
    ("renamed over it", |p, b| {
        fs::write(p.sibling("new"), b)?;
        fs::rename(p.sibling("new"), &p.path)
    }),
    ("synced and renamed over it", |p, b| {
        synced(&p.sibling("new"), b)?;
        fs::rename(p.sibling("new"), &p.path)
    }),
    ("synced, renamed, folder synced", |p, b| {
        synced(&p.sibling(".new"), b)?;
        fs::rename(p.sibling(".new"), &p.path)?;
        p.sync_folder()
    }),
    ("trickled into a new file and renamed", |p, b| {
        in_pieces(&p.sibling("new.xml"), b, b.len() / 20 + 1, STEP)?;
        fs::rename(p.sibling("new.xml"), &p.path)
    }),
    ("exchanged with a new file", |p, b| {
        fs::write(p.sibling("other.xml"), b)?;
        renameat_with(CWD, p.sibling("other.xml"), CWD, &p.path, RenameFlags::EXCHANGE)?;
        fs::remove_file(p.sibling("other.xml"))
    }),
    ("deleted and written", |p, b| {
        fs::remove_file(&p.path)?;
        fs::write(&p.path, b)
    }),
    ("deleted, a pause, written", |p, b| {
        fs::remove_file(&p.path)?;
        sleep(PAUSE);
        fs::write(&p.path, b)
    }),
    ("deleted, a pause, moved there", |p, b| {
        fs::write(p.apart(), b)?;
        fs::remove_file(&p.path)?;
        sleep(PAUSE);
        fs::rename(p.apart(), &p.path)
    }),
    ("moved away, a pause, a new one", |p, b| {
        fs::rename(&p.path, p.sibling("old.xml"))?;
        sleep(PAUSE);
        fs::write(&p.path, b)
    }),
    ("a folder in its place for a while", |p, b| {
        fs::remove_file(&p.path)?;
        fs::create_dir(&p.path)?;
        sleep(PAUSE);
        fs::remove_dir(&p.path)?;
        fs::write(&p.path, b)
    }),
    // As editors do.
    ("vim", |p, b| {
        fs::write(p.named(".", ".swp"), "b0VIM")?;
        fs::write(p.sibling("4913"), "")?;
        fs::remove_file(p.sibling("4913"))?;
        fs::rename(&p.path, p.named("", "~"))?;
        synced(&p.path, b)?;
        fs::remove_file(p.named("", "~"))?;
        fs::remove_file(p.named(".", ".swp"))
    }),
    ("vim, backupcopy=yes", |p, b| {
        fs::copy(&p.path, p.named("", "~"))?;
        synced(&p.path, b)?;
        fs::remove_file(p.named("", "~"))
    }),
    ("emacs", |p, b| {
        gone(&p.named(".#", ""))?;
        symlink("user@host.4711:1", p.named(".#", ""))?;
        fs::rename(&p.path, p.named("", "~"))?;
        synced(&p.path, b)?;
        fs::remove_file(p.named(".#", ""))
    }),
    ("emacs, backup-by-copying", |p, b| {
        fs::write(p.named("#", "#"), b)?;
        fs::copy(&p.path, p.named("", "~"))?;
        synced(&p.path, b)?;
        fs::remove_file(p.named("#", "#"))
    }),
    ("VS Code", |p, b| {
        File::create(&p.path)?.set_len(0)?;
        let mut file = writing(&p.path)?;
        file.write_all(b)?;
        file.sync_data()
    }),
    ("nano with a backup", |p, b| {
        fs::copy(&p.path, p.named("", "~"))?;
        fs::write(&p.path, b)
    }),
    ("gedit", |p, b| {
        let new = p.sibling(".goutputstream-A1B2C3");
        synced(&new, b)?;
        gone(&p.named("", "~"))?;
        fs::hard_link(&p.path, p.named("", "~"))?;
        fs::rename(new, &p.path)
    }),
    ("Kate", |p, b| {
        synced(&p.named("", ".pXq7Zk"), b)?;
        fs::rename(p.named("", ".pXq7Zk"), &p.path)
    }),
    ("JetBrains", |p, b| {
        fs::write(p.named("", "___jb_tmp___"), b)?;
        fs::rename(&p.path, p.named("", "___jb_old___"))?;
        fs::rename(p.named("", "___jb_tmp___"), &p.path)?;
        fs::remove_file(p.named("", "___jb_old___"))
    }),
    ("git checkout", |p, b| {
        fs::remove_file(&p.path)?;
        OpenOptions::new().write(true).create_new(true).open(&p.path)?.write_all(b)
    }),
    // By links.
    ("a link to another version", |p, b| {
        fs::write(p.apart(), b)?;
        link_over(p, &p.apart())
    }),
    ("behind a link, in another folder", |p, b| {
        if !p.path.is_symlink() {
            fs::copy(&p.path, p.apart())?;
            link_over(p, &p.apart())?;
            // configd watches the target's folder only after it has seen the link.
            sleep(PAUSE * 2);
        }
        fs::write(&p.path, b)
    }),
    ("a link to a link to a folder that is swapped", |p, b| {
        let folder = p.elsewhere.join(format!("data-{}", p.n));
        fs::create_dir_all(&folder)?;
        fs::write(folder.join("file.xml"), b)?;
        let (data, new) = (p.named("..", "-data"), p.sibling("..new"));
        gone(&new)?;
        symlink(&folder, &new)?;
        fs::rename(new, &data)?;
        link_over(p, &data.join("file.xml"))
    }),
];
