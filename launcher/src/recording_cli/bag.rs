//! `armor bag`: what is in recordings, and copies of parts of them.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_recording::{
    BEGIN_KEY, CopiedPart, LeftOutMessages, OutputSelection, Recording, RecordingForm,
    RecordingSummary, copy_recordings,
};
use armor_robotfile::advise_similar;
use clap::{Args, Subcommand};
use serde_json::json;

use super::convert::{ConvertArguments, convert};
use super::format_len;
use super::known_types::{ChangedType, KnownTypes, describe_change_within};
use super::record::{RecordCompression, parse_selection};
use crate::arguments::{OutputFormat, parse_duration};
use crate::exit::CommandEnding;
use crate::message_cli::MessageSource;
use crate::print::{Table, end_printing, print_line, print_notice, terminal_width};
use crate::verb::Verb;

/// Work with recordings: MCAP files that `armor record` has written.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  armor bag info drive.mcap
  armor bag info drive.mcap --components build         are its types those of these components?
  armor bag recover broken.mcap whole.mcap             after a crash of the recorder
  armor bag cut drive.mcap part.mcap --from 10s --to 20s --data mapper.pose
  armor bag merge front.mcap rear.mcap both.mcap
  armor bag convert drive.mcap pose.csv --data mapper.pose
  armor bag convert drive.mcap ros2.mcap --to ros2
  armor bag convert drive.mcap drive.bag               a bag of ROS 1, and back:
  armor bag convert drive.bag drive.mcap
  armor bag convert drive.mcap drive.log               scans and odometry as a log of CARMEN, and back:
  armor bag convert intel.log.gz intel.mcap
  armor bag convert pose.csv pose.mcap --data gps.pose --type PoseStamped")]
pub enum BagCommand {
    /// Show what is in a recording: outputs, counts, losses, files, and the types that have other fields
    /// in this program, or in the components of a folder or a file.
    Info {
        /// The recording.
        recording: PathBuf,
        #[command(flatten)]
        source: MessageSource,
    },
    /// Complete a recording whose recorder was killed: everything that can be read.
    Recover {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        copy: CopyArguments,
    },
    /// Copy a part of a recording.
    Cut {
        /// The recording.
        file: PathBuf,
        #[command(flatten)]
        copy: CopyArguments,
        /// Begin this time after its beginning.
        #[arg(long, value_parser = parse_duration, value_name = "TIME")]
        from: Option<Duration>,
        /// End this time after its beginning.
        #[arg(long, value_parser = parse_duration, value_name = "TIME")]
        to: Option<Duration>,
        /// Copy this output alone, or with COMPONENT.* those of a component; may be given several
        /// times.
        #[arg(long = "data", value_name = "DATA", value_parser = parse_selection)]
        data: Vec<String>,
    },
    /// Convert a recording from and for other programs: ROS 2, ROS 1, CARMEN, CSV.
    Convert(ConvertArguments),
    /// Copy several recordings into one, by the time of their messages.
    Merge {
        /// The recordings, and last the file to write, which must not be there yet.
        #[arg(required = true, num_args = 2..)]
        files: Vec<PathBuf>,
        /// How the copy is compressed.
        #[arg(long, value_enum, default_value_t, value_name = "HOW")]
        compress: RecordCompression,
    },
}

/// A copy.
#[derive(Args, Debug)]
pub struct CopyArguments {
    /// File to write, which must not be there yet.
    pub copy: PathBuf,
    /// How the copy is compressed.
    #[arg(long, value_enum, default_value_t, value_name = "HOW")]
    pub compress: RecordCompression,
}

impl Verb for BagCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let ending = match self {
            Self::Info { recording, source } => show_recording(&recording, &source, format)?,
            Self::Recover { file, copy } => {
                let part = CopiedPart::default();
                copy_part(&[file], &copy.copy, &part, copy.compress, format)?
            }
            Self::Cut { file, copy, from, to, data } => {
                let part = find_part(&file, from, to, data)?;
                copy_part(&[file], &copy.copy, &part, copy.compress, format)?
            }
            Self::Convert(arguments) => convert(&arguments, format)?,
            Self::Merge { mut files, compress } => {
                let Some(copy) = files.pop().filter(|_| !files.is_empty()) else {
                    bail!("name the recordings, and last the file to write");
                };
                copy_part(&files, &copy, &CopiedPart::default(), compress, format)?
            }
        };
        Ok(ending.into())
    }
}

fn open(file: &Path) -> Result<Recording> {
    Recording::open(file)
        .with_context(|| format!("{} cannot be read as a recording", file.display()))
}

fn show_recording(
    file: &Path,
    source: &MessageSource,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let recording = open(file)?;
    let summary = recording.summary();
    let changed = KnownTypes::gather(source)?.find_changed(summary);
    end_printing(if format == OutputFormat::Json {
        print_line(summary_json(summary, &changed))
    } else {
        print_line(format_summary(summary, &changed))
    })
}

fn summary_json(summary: &RecordingSummary, changed: &[ChangedType]) -> serde_json::Value {
    let outputs = summary.outputs.iter().map(|output| {
        json!({
            "data": output.data, "type": output.type_name, "ros_type": output.ros_type,
            "messages": output.messages, "lost": output.lost, "latched": output.latched,
            "rate_hz": output.rate_hz(), "earlier_schemas": output.earlier_schemas,
        })
    });
    let files = summary
        .files
        .iter()
        .map(|file| json!({ "name": file.name, "bytes": file.len, "since_s": file.stamp_s }));
    json!({
        "complete": summary.is_complete,
        "about": summary.about,
        "from_s": summary.begin_s(),
        "to_s": summary.span_s.map(|span| span.1),
        "outputs": outputs.collect::<Vec<_>>(),
        "files": files.collect::<Vec<_>>(),
        "other_types": changed.iter().map(ChangedType::to_json).collect::<Vec<_>>(),
    })
}

fn format_summary(summary: &RecordingSummary, changed: &[ChangedType]) -> String {
    let mut text = String::new();
    for (key, value) in summary.about.iter().filter(|(key, _)| *key != BEGIN_KEY) {
        text += &format!("{key:<9}  {value}\n");
    }
    if let (Some(from_s), Some((_, to_s))) = (summary.begin_s(), summary.span_s) {
        text += &format!("{:<9}  {from_s:.3} s to {to_s:.3} s, {:.1} s\n", "time", to_s - from_s);
    }
    for file in &summary.files {
        let since_s = file.stamp_s.zip(summary.begin_s()).map(|(at_s, begin_s)| at_s - begin_s);
        let since = since_s.map_or(String::new(), |since_s| format!(", since {since_s:.1} s"));
        text += &format!("{:<9}  {}, {}{since}\n", "contains", file.name, format_len(file.len));
    }
    if !summary.is_complete {
        text += "complete   no: its recorder was killed; armor bag recover completes a copy\n";
    }
    for change in summary.outputs.iter().filter_map(describe_change_within) {
        text += &format!("types      {change}\n");
    }
    for change in changed.iter().map(ChangedType::describe) {
        text += &format!("types      {change}; it is read with its own\n");
    }
    let rows = summary.outputs.iter().map(|output| {
        vec![
            output.data.clone(),
            if output.type_name.is_empty() { &output.ros_type } else { &output.type_name }.clone(),
            output.messages.to_string(),
            output.rate_hz().map_or_else(|| "-".into(), |hz| format!("{hz:.1} Hz")),
            output.lost.to_string(),
        ]
    });
    let table = Table::new(&["DATA", "TYPE", "MESSAGES", "RATE", "LOST"], rows.collect());
    text + table.dispensable(&["RATE"]).format(terminal_width()).trim_end()
}

/// Returns the part with its times in system time.
pub fn find_part(
    file: &Path,
    from: Option<Duration>,
    to: Option<Duration>,
    data: Vec<String>,
) -> Result<CopiedPart> {
    let recording = open(file)?;
    let summary = recording.summary();
    let known = || summary.outputs.iter().map(|output| output.data.as_str());
    if let Some(name) = OutputSelection::find_missing(&data, known()).first() {
        let advice = advise_similar(name, known());
        bail!("{} has no {name}{advice} (armor bag info shows what it has)", file.display());
    }
    let begin_s = summary.begin_s().unwrap_or_default();
    let length_s = summary.span_s.map_or(0.0, |span| span.1 - begin_s);
    let is_empty =
        from.is_some_and(|from| from.as_secs_f64() > length_s || to.is_some_and(|to| to <= from));
    if is_empty {
        bail!("nothing is in that part: {} has {length_s:.1} s", file.display());
    }
    let moment = |after: Duration| begin_s + after.as_secs_f64();
    let outputs = OutputSelection { include: data, exclude: Vec::new() };
    Ok(CopiedPart { from_s: from.map(moment), to_s: to.map(moment), outputs })
}

/// Prints what a copy lacks, and why.
pub fn print_left_out(left_out: &LeftOutMessages, damaged_chunks: u64) {
    for (data, (count, reason)) in &left_out.outputs {
        print_notice(format!("{data}: {count} messages are left out: {reason}"));
    }
    if damaged_chunks > 0 {
        print_notice(format!(
            "{damaged_chunks} parts of the file are damaged, and are left out: up to 1 MB of data \
             each"
        ));
    }
}

/// The outputs of which a copy lacks messages.
pub fn left_out_json(left_out: &LeftOutMessages) -> serde_json::Value {
    let outputs = left_out.outputs.iter();
    outputs
        .map(|(data, (count, reason))| json!({ "data": data, "messages": count, "reason": reason }))
        .collect()
}

fn copy_part(
    files: &[PathBuf],
    copy: &Path,
    part: &CopiedPart,
    compress: RecordCompression,
    format: OutputFormat,
) -> Result<CommandEnding> {
    // Before the copy is created, so that a wrong name leaves nothing.
    for file in files {
        open(file)?;
    }
    let sink =
        File::create_new(copy).with_context(|| format!("{} cannot be created", copy.display()))?;
    let paths: Vec<_> = files.iter().map(PathBuf::as_path).collect();
    let (report, sink) = {
        let (sink, form) = (BufWriter::new(sink), RecordingForm::Armor);
        copy_recordings(&paths, part, sink, compress.into(), form)?
    };
    let file = sink.into_inner().context("the copy cannot be written")?;
    file.sync_all().with_context(|| copy.display().to_string())?;
    print_left_out(&report.left_out, report.damaged_chunks);
    end_printing(if format == OutputFormat::Json {
        print_line(json!({
            "file": copy, "messages": report.copied, "unreadable": report.left_out.count(),
            "left_out": left_out_json(&report.left_out),
        }))
    } else {
        print_line(format!("{}: {} messages", copy.display(), report.copied))
    })
}
