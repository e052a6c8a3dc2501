//! `armor bag convert`: recordings from and for other programs.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_carmen_player::log::CarmenLog;
use armor_carmen_player::messages::{make_laser_scan, make_odometry};
use armor_carmen_player::playback::{OdometrySource, Playback};
use armor_carmen_player::record::Mount;
use armor_recording::ros1_bag::{BAG_MAGIC, Ros1Bag};
use armor_recording::{
    CopiedPart, LeftOutMessages, MessageHead, OutputSelection, OutputType, Recording,
    RecordingForm, RecordingWriter, Ros1Writer, copy_recordings,
};
use armor_sdk::messages::{FrameTransforms, LaserScan, Odometry};
use armor_wire::codec;
use armor_wire::message::Message;
use armor_wire::name::is_name;
use armor_wire::schema::{self, to_json};
use clap::{Args, ValueEnum};
use serde_json::json;

use super::bag::{find_part, left_out_json, print_left_out};
use super::carmen_writer::write_carmen;
use super::csv_reader::{CsvMessage, CsvMessages};
use super::record::{RecordCompression, parse_selection};
use crate::arguments::{KindFolders, OutputFormat, parse_duration};
use crate::exit::CommandEnding;
use crate::inspect_cli::echo::csv::CsvTable;
use crate::message_cli::MessageSource;
use crate::message_cli::known_messages::KnownMessages;
use crate::print::{end_printing, print_line, print_notice};

/// How an MCAP file begins.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// The component whose outputs a log of CARMEN becomes.
const CARMEN: &str = "carmen";
/// Readings from here on mean that nothing was seen, as the player of logs takes them.
const RANGE_MAX_M: f32 = 50.0;

/// What a recording is converted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ConvertedForm {
    /// A recording of Armor.
    Armor,
    /// A recording of ROS 2, in MCAP.
    Ros2,
    /// Comma-separated values: one file for each output.
    Csv,
    /// A bag of ROS 1, not compressed.
    Ros1,
    /// A log of CARMEN: scans of one laser, with odometry.
    Carmen,
}

/// A conversion.
#[derive(Args, Debug)]
pub struct ConvertArguments {
    /// A recording of Armor or ROS 2 (MCAP), a bag of ROS 1, a log of CARMEN, plain or gzip, or a table
    /// (.csv) with a column `stamp_s`, and for each field one that has its path as name.
    pub file: PathBuf,
    /// What is written, and must not be there yet: a file, or with several outputs as CSV a folder.
    pub copy: PathBuf,
    /// The form. Default: by the end of the name (.csv, .bag, .log), else a recording of Armor.
    #[arg(long, value_enum, value_name = "FORM")]
    pub to: Option<ConvertedForm>,
    /// Convert this output alone, or with COMPONENT.* those of a component; may be given several times.
    #[arg(long = "data", value_name = "DATA", value_parser = parse_selection)]
    pub data: Vec<String>,
    /// Begin this time after the beginning.
    #[arg(long, value_parser = parse_duration, value_name = "TIME")]
    pub from: Option<std::time::Duration>,
    /// End this time after the beginning.
    #[arg(long = "until", value_parser = parse_duration, value_name = "TIME")]
    pub until: Option<std::time::Duration>,
    /// The message of a row of a table, which becomes the output that --data names.
    #[arg(long = "type", value_name = "MESSAGE")]
    pub message: Option<String>,
    #[command(flatten)]
    pub kinds: KindFolders,
    /// How a recording is compressed.
    #[arg(long, value_enum, default_value_t, value_name = "HOW")]
    pub compress: RecordCompression,
}

/// Converts a file.
///
/// # Errors
/// If it cannot be read, or the copy cannot be written.
pub fn convert(arguments: &ConvertArguments, format: OutputFormat) -> Result<CommandEnding> {
    let ConvertArguments { file, copy, .. } = arguments;
    let to = arguments.to.unwrap_or_else(|| find_form(copy));
    let mut magic = Vec::new();
    let opened = File::open(file).with_context(|| file.display().to_string())?;
    if arguments.to.is_none() {
        refuse_unwritten_form(copy)?;
    }
    opened.take(BAG_MAGIC.len() as u64).read_to_end(&mut magic)?;
    let (messages, left_out, damaged_chunks) = if magic.starts_with(MCAP_MAGIC) {
        let ConvertArguments { from, until, data, .. } = arguments;
        let part = find_part(file, *from, *until, data.clone())?;
        match to {
            ConvertedForm::Armor => copy_messages(arguments, &part, RecordingForm::Armor)?,
            ConvertedForm::Ros2 => copy_messages(arguments, &part, RecordingForm::Ros2)?,
            ConvertedForm::Csv => write_tables(file, copy, &part)?,
            ConvertedForm::Ros1 => write_bag(file, copy, &part)?,
            ConvertedForm::Carmen => write_carmen(file, copy, &part)?,
        }
    } else if !matches!(to, ConvertedForm::Armor | ConvertedForm::Ros2) {
        let form = if magic == BAG_MAGIC {
            "a bag of ROS 1"
        } else if is_table(file) {
            "a table"
        } else {
            "no MCAP file, so it is read as a log of CARMEN"
        };
        bail!(
            "{} is {form}: that is converted to a recording; convert the recording then",
            file.display()
        );
    } else if magic == BAG_MAGIC {
        let (messages, left_out) = convert_bag(arguments, to)?;
        (messages, left_out, 0)
    } else if is_table(file) {
        (convert_table(arguments, form_of(to))?, LeftOutMessages::default(), 0)
    } else {
        let is_part =
            !arguments.data.is_empty() || arguments.from.is_some() || arguments.until.is_some();
        if is_part {
            bail!(
                "{} is no MCAP file, so it is read as a log of CARMEN: that is converted whole, to a \
                 recording; convert the recording then",
                file.display()
            );
        }
        (convert_carmen(arguments, form_of(to))?, LeftOutMessages::default(), 0)
    };
    print_left_out(&left_out, damaged_chunks);
    end_printing(if format == OutputFormat::Json {
        print_line(json!({
            "file": copy, "messages": messages, "unreadable": left_out.count(),
            "left_out": left_out_json(&left_out),
        }))
    } else {
        print_line(format!("{}: {messages} messages", copy.display()))
    })
}

/// Refuses a name that promises a form which is read, and not written.
fn refuse_unwritten_form(copy: &Path) -> Result<()> {
    let form = match extension_of(copy) {
        "db3" => "a database of ROS 2",
        "gz" => "a compressed log",
        _ => return Ok(()),
    };
    bail!(
        "{}: {form} is not written; name a file that ends with .mcap, .bag, .log or .csv, or give the \
         form with `--to`",
        copy.display()
    )
}

fn extension_of(path: &Path) -> &str {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or_default()
}

/// The form that the name of a file promises.
fn find_form(copy: &Path) -> ConvertedForm {
    match extension_of(copy) {
        "csv" => ConvertedForm::Csv,
        "bag" => ConvertedForm::Ros1,
        "log" | "clf" => ConvertedForm::Carmen,
        _ => ConvertedForm::Armor,
    }
}

fn is_table(file: &Path) -> bool {
    extension_of(file) == "csv"
}

fn form_of(to: ConvertedForm) -> RecordingForm {
    if to == ConvertedForm::Ros2 { RecordingForm::Ros2 } else { RecordingForm::Armor }
}

pub fn create(path: &Path) -> Result<BufWriter<File>> {
    let file = File::create_new(path);
    Ok(BufWriter::new(file.with_context(|| format!("{} cannot be created", path.display()))?))
}

fn copy_messages(
    arguments: &ConvertArguments,
    part: &CopiedPart,
    form: RecordingForm,
) -> Result<(u64, LeftOutMessages, u64)> {
    let sink = create(&arguments.copy)?;
    let (report, mut sink) =
        copy_recordings(&[&arguments.file], part, sink, arguments.compress.into(), form)?;
    sink.flush()?;
    Ok((report.copied, report.left_out, report.damaged_chunks))
}

/// Copies the messages of a bag of ROS 1. Returns how many, and those that have no type of Armor.
fn convert_bag(arguments: &ConvertArguments, to: ConvertedForm) -> Result<(u64, LeftOutMessages)> {
    let ConvertArguments { file, copy, from, until, data, .. } = arguments;
    let not_readable = || format!("{} cannot be read", file.display());
    let mut bag = Ros1Bag::begin(BufReader::new(File::open(file)?)).with_context(not_readable)?;
    let selection = OutputSelection { include: data.clone(), exclude: Vec::new() };
    let form = form_of(to);
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let about = BTreeMap::from([("file".to_owned(), name)]);
    let compression = arguments.compress.into();
    let mut writer = RecordingWriter::with_form(create(copy)?, compression, about, form)?;
    let (mut begin_s, mut left_out) = (None, LeftOutMessages::default());
    while let Some(message) = bag.next_message().with_context(not_readable)? {
        let stamp_s = message.head.stamp_s;
        let after_s = stamp_s - *begin_s.get_or_insert(stamp_s);
        let is_in_part = from.is_none_or(|from| after_s >= from.as_secs_f64())
            && until.is_none_or(|until| after_s < until.as_secs_f64());
        if !is_in_part || !selection.holds(&message.data) {
            continue;
        }
        let payload = match &message.payload {
            Ok(payload) => payload,
            Err(reason) => {
                left_out.add(&message.data, reason);
                continue;
            }
        };
        let output = writer.add_output(&message.data, &message.output_type)?;
        writer.write(output, &message.head, payload)?;
    }
    let written = writer.count_written();
    writer.finish()?.flush()?;
    Ok((written, left_out))
}

/// Writes the messages as a bag of ROS 1.
fn write_bag(file: &Path, copy: &Path, part: &CopiedPart) -> Result<(u64, LeftOutMessages, u64)> {
    let mut recording = Recording::open(file)?;
    let mut writer = Ros1Writer::begin(create(copy)?)?;
    let mut left_out = LeftOutMessages::default();
    recording.select(|data| part.outputs.holds(data));
    while let Some(message) = recording.next_message()? {
        if !part.holds_time(message.head.stamp_s) {
            continue;
        }
        let written = match &message.payload {
            Ok(payload) => {
                let (data, stamp_s) = (&message.data, message.head.stamp_s);
                let written = writer.write(data, &message.output_type, stamp_s, payload)?;
                written.map_err(|reason| reason.to_string())
            }
            Err(reason) => Err(reason.clone()),
        };
        if let Err(reason) = written {
            left_out.add(&message.data, &reason);
        }
    }
    let written = writer.count_written();
    writer.finish()?.into_inner().context("the copy cannot be written")?.sync_all()?;
    Ok((written, left_out, recording.damaged_chunks()))
}

/// Writes the rows of a table as messages of one output. Returns how many there are.
fn convert_table(arguments: &ConvertArguments, form: RecordingForm) -> Result<u64> {
    let ConvertArguments { file, copy, data, message, kinds, compress, .. } = arguments;
    let shown = file.display();
    let ([data], Some(message)) = (data.as_slice(), message) else {
        bail!(
            "{shown} is a table: name the output that its rows become with --data COMPONENT.OUTPUT, and \
             their message with --type (`armor message list` shows all)"
        );
    };
    let is_name = data.split_once('.').is_some_and(|(a, b)| is_name(a) && is_name(b));
    if !is_name || arguments.from.is_some() || arguments.until.is_some() {
        bail!(
            "{shown} is a table, which becomes one output whole: give --data COMPONENT.OUTPUT alone"
        );
    }
    let known = KnownMessages::gather(&MessageSource { file: None, kinds: kinds.clone() })?;
    let schema = known.find_one(message)?.definition.schema.clone();
    let source = BufReader::new(File::open(file).with_context(|| shown.to_string())?);
    let mut table = CsvMessages::begin(source, schema.clone(), file)?;
    let output_type =
        OutputType { name: message.clone(), schema: schema.to_string(), latched: false };
    let mut writer =
        RecordingWriter::with_form(create(copy)?, (*compress).into(), BTreeMap::new(), form)?;
    let output = writer.add_output(data, &output_type)?;
    while let Some(CsvMessage { stamp_s, sequence, payload }) =
        table.next_message().with_context(|| shown.to_string())?
    {
        let head = MessageHead { sequence, stamp_s, instance: 1, ..MessageHead::default() };
        writer.write(output, &head, &payload)?;
    }
    let written = writer.count_written();
    writer.finish()?.flush()?;
    Ok(written)
}

/// A table that is being written.
struct OpenTable {
    table: CsvTable,
    file: BufWriter<File>,
    /// The fields of the first message.
    schema: String,
    is_change_reported: bool,
}

/// Writes one file of comma-separated values for each output: into `copy`, if it is one output.
fn write_tables(
    file: &Path,
    copy: &Path,
    part: &CopiedPart,
) -> Result<(u64, LeftOutMessages, u64)> {
    let mut recording = Recording::open(file)?;
    let outputs = &recording.summary().outputs;
    let chosen: Vec<_> = outputs.iter().filter(|output| part.outputs.holds(&output.data)).collect();
    let is_one = chosen.len() == 1;
    if !is_one {
        std::fs::create_dir(copy)
            .with_context(|| format!("{} cannot be created", copy.display()))?;
    }
    let mut tables: BTreeMap<String, Option<OpenTable>> = BTreeMap::new();
    let (mut written, mut left_out) = (0, LeftOutMessages::default());
    while let Some(message) = recording.next_message()? {
        let stamp_s = message.head.stamp_s;
        let is_meant = part.outputs.holds(&message.data) && part.holds_time(stamp_s);
        if !is_meant {
            continue;
        }
        let value = message.payload.and_then(|payload| {
            let schema = schema::parse(&message.output_type.schema).map_err(|it| it.to_string())?;
            to_json(&schema, &payload).map_err(|it| it.to_string())
        });
        let value = match value {
            Ok(value) => value,
            Err(reason) => {
                left_out.add(&message.data, &reason);
                continue;
            }
        };
        if !tables.contains_key(&message.data) {
            let path = if is_one { copy.to_owned() } else { copy.join(&message.data) };
            let path = if is_one { path } else { path.with_added_extension("csv") };
            let opened = match CsvTable::new(&value, &[]) {
                Ok(table) => {
                    let mut file = create(&path)?;
                    writeln!(file, "{}", table.heading())?;
                    let schema = message.output_type.schema.clone();
                    Some(OpenTable { table, file, schema, is_change_reported: false })
                }
                Err(_) => {
                    let data = &message.data;
                    print_notice(format!("{data} has only arrays, and is left out"));
                    None
                }
            };
            tables.insert(message.data.clone(), opened);
        }
        if let Some(Some(open)) = tables.get_mut(&message.data) {
            if open.schema != message.output_type.schema && !open.is_change_reported {
                open.is_change_reported = true;
                let (first, later) = (&open.schema, &message.output_type.schema);
                let lines =
                    schema::difference(("the first message", first), ("a later one", later));
                print_notice(format!(
                    "{}: its fields change at {stamp_s} s, and the columns are those of its first \
                     message: {}",
                    message.data,
                    lines.replace('\n', "; ")
                ));
            }
            writeln!(open.file, "{}", open.table.row(stamp_s, message.head.sequence, &value))?;
            written += 1;
        }
    }
    for open in tables.into_values().flatten() {
        open.file.into_inner().context("a table cannot be written")?.sync_all()?;
    }
    Ok((written, left_out, recording.damaged_chunks()))
}

/// Writes scans, odometry and transforms of a log. Returns how many messages there are.
fn convert_carmen(arguments: &ConvertArguments, form: RecordingForm) -> Result<u64> {
    let ConvertArguments { file, copy, compress, .. } = arguments;
    let shown = file.display();
    let log = CarmenLog::<Box<dyn BufRead + Send>>::open(file)
        .with_context(|| format!("{shown} cannot be read as a log of CARMEN"))?;
    let mut playback = Playback::new(log, Mount::Front, OdometrySource::Scan, 0.0);
    let Some(first) = playback.next_due(0.0).with_context(|| shown.to_string())? else {
        bail!("{shown} is neither an MCAP file nor a log of CARMEN with scans of a front laser");
    };
    let mut writer =
        RecordingWriter::with_form(create(copy)?, (*compress).into(), BTreeMap::new(), form)?;
    let scans = writer.add_output(&format!("{CARMEN}.scan"), &type_of::<LaserScan>())?;
    let odometry = writer.add_output(&format!("{CARMEN}.odometry"), &type_of::<Odometry>())?;
    let frames =
        writer.add_output(&format!("{CARMEN}.transforms"), &type_of::<FrameTransforms>())?;
    let (mut next, mut last_s, mut sequence) = (Some(first), None, 0);
    while let Some(scan) = next {
        let head =
            MessageHead { sequence, stamp_s: scan.stamp_s, instance: 1, ..MessageHead::default() };
        let moved = make_odometry(&scan);
        let scan_time_s = last_s.map_or(0.0, |last_s| scan.stamp_s - last_s);
        writer.write(frames, &head, &codec::encode(&FrameTransforms::from_odometry(&moved))?)?;
        writer.write(odometry, &head, &codec::encode(&moved)?)?;
        // From its own largest range on, a laser has seen nothing.
        let own_max_m = scan.beams.range_max_m.map_or(RANGE_MAX_M, |max_m| max_m as f32);
        let ranges = make_laser_scan(&scan, own_max_m.min(RANGE_MAX_M), scan_time_s);
        writer.write(scans, &head, &codec::encode(&ranges)?)?;
        last_s = Some(scan.stamp_s);
        sequence += 1;
        next = playback.next_due(0.0).with_context(|| shown.to_string())?;
    }
    if let Some(damage) = playback.damage() {
        print_notice(format!("{shown} breaks off: {damage}"));
    }
    let malformed = playback.tally().malformed;
    if malformed > 0 {
        print_notice(format!("{malformed} lines are malformed, and are left out"));
    }
    let written = writer.count_written();
    writer.finish()?.flush()?;
    Ok(written)
}

fn type_of<T: Message>() -> OutputType {
    OutputType { name: T::NAME.into(), schema: T::schema().to_string(), latched: false }
}
