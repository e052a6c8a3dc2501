//! `armor keys certificate`: what a phone installs to trust the pages of robots.

use std::fs::OpenOptions;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use armor_keys::authority_certificate::read_authority_certificate;
use clap::Args;
use rustix::fs::OFlags;
use rustix::io::Errno;
use serde_json::json;

use super::KeysDirectory;
use crate::arguments::OutputFormat;
use crate::print::{print_line, print_wrapped};

#[derive(Args, Debug)]
pub struct CertificateArguments {
    /// The file.
    #[arg(long, value_name = "FILE", default_value = "authority.crt")]
    out: PathBuf,
    #[command(flatten)]
    directory: KeysDirectory,
}

/// Writes the file.
pub(super) fn write_certificate(
    arguments: &CertificateArguments,
    format: OutputFormat,
) -> Result<()> {
    let certificate = read_authority_certificate(&arguments.directory.path()?)?;
    let out = arguments.out.display();
    write_unlinked(&arguments.out, &certificate.der).with_context(|| format!("{out}"))?;
    let fingerprint = &certificate.fingerprint;
    if format == OutputFormat::Json {
        return print_line(json!({"file": arguments.out, "fingerprint": fingerprint}));
    }
    print_line(format_args!("{out}: SHA-256 {fingerprint}"))?;
    print_wrapped(format_args!(
        "it is not secret; a browser that trusts it opens the pages of these robots without a \
         warning, and believes those with the secret key of the authority about every other site, \
         too: install it only on devices of the people who work with the robots"
    ))
}

/// Writes the file. A symbolic link is not followed: in a folder of several users it could lead to any
/// file of this one.
fn write_unlinked(path: &Path, bytes: &[u8]) -> Result<()> {
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed();
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(true).custom_flags(flags);
    let opened = options.open(path).map_err(|error| match Errno::from_io_error(&error) {
        Some(Errno::LOOP) => anyhow!(
            "it is a symbolic link, which is not followed: remove it, or name another file with --out"
        ),
        _ => error.into(),
    });
    Ok(opened?.write_all(bytes)?)
}
