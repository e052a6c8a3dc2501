//! `armor keys certificate`: what a phone installs to trust the pages of robots.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use armor_keys::authority_certificate::read_authority_certificate;
use clap::Args;
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
    fs::write(&arguments.out, &certificate.der).with_context(|| format!("{out}"))?;
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
