//! Prints the figures of docs/recordings.md: 200 MB/s from 20 outputs next to the crate `mcap` alone,
//! a recorder that is killed a hundred times, and a recording of a gigabyte.
//!
//! `cargo run --release -p armor-recording --example recording_figures -- FOLDER [LOAD|KILLS|SEEK]`.
//! The folder determines which disk is measured; what is written there is removed. Each part that is measured
//! is a process of its own: this program again, with the role as its first argument.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use armor_inspect::ObservedSystem;
use armor_recording::capture::{Recorder, RecorderOptions, RecordingPath, SplitLimits};
use armor_recording::{Compression, OutputSelection, Recording};
use armor_registry::{RegistryOptions, serve};
use armor_sdk::messages::CompressedImage;
use armor_sdk::node::{NodeOptions, SystemNode};
use mcap::records::MessageHeader;
use rustix::fs::{Advice, fadvise};
use rustix::process::{Signal, kill_process};
use rustix::time::{ClockId, clock_gettime};

type Failure = Box<dyn Error + Send + Sync>;

const OUTPUTS: usize = 20;
const MESSAGE_LEN: usize = 100_000;
/// 20 outputs of 100 kB at 100 Hz are 200 MB/s.
const RATE_HZ: u32 = 100;
const LOAD_FOR: Duration = Duration::from_secs(8);
const ROUNDS: u32 = 3;
/// A recording has a record in front of each message.
const RECORDS_PER_MESSAGE: usize = 2;
/// Of a recording, so many bytes are written again and again.
const SOURCE_LEN: u64 = 128 << 20;
const KILLS: u32 = 100;
/// The load while recorders are killed: 20 outputs of 1 kB at 100 Hz.
const SMALL_LEN: usize = 1_000;
const CHUNK_LEN: u64 = 1 << 20;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["publish", registry, len] => publish(registry, len.parse()?),
        ["record", registry, file, seconds] => record(registry, file, seconds.parse()?),
        ["write", file, source, count] => write_again(file, source, count.parse()?, false),
        ["write-paced", file, source, count] => write_again(file, source, count.parse()?, true),
        ["write-one", file, count] => write_one_buffer(file, count.parse()?),
        [folder] => {
            measure_load(Path::new(folder))?;
            measure_kills(Path::new(folder))?;
            measure_seek(Path::new(folder))
        }
        [folder, "LOAD"] => measure_load(Path::new(folder)),
        [folder, "KILLS"] => measure_kills(Path::new(folder)),
        [folder, "SEEK"] => measure_seek(Path::new(folder)),
        _ => Err("write FOLDER, and after it LOAD, KILLS or SEEK for one of the three".into()),
    }
}

/// A registry in this process, and a process that publishes.
struct Load {
    registry: String,
    publisher: Child,
}

impl Load {
    fn start(len: usize) -> Result<Self, Failure> {
        let (sender, address) = mpsc::channel();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            let options =
                RegistryOptions { listen: ([127, 0, 0, 1], 0).into(), ..Default::default() };
            let ready = move |address| sender.send(address).unwrap_or_default();
            let serving = serve(options, ready);
            runtime.map(|runtime| runtime.block_on(serving).map(drop))
        });
        let registry = address.recv_timeout(Duration::from_secs(5))?.to_string();
        let publisher = start_role(&["publish", &registry, &len.to_string()])?;
        let observed = ObservedSystem::at(&registry, "figures");
        while observed.list().is_ok_and(|listing| listing.data.len() < OUTPUTS) {
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(Self { registry, publisher })
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        let _ = self.publisher.kill();
        let _ = self.publisher.wait();
    }
}

fn start_role(arguments: &[&str]) -> Result<Child, Failure> {
    let program = std::env::current_exe()?;
    Ok(Command::new(program).args(arguments).stdout(Stdio::piped()).spawn()?)
}

/// Numbers that a role prints at its end.
fn run_role(arguments: &[&str]) -> Result<Vec<f64>, Failure> {
    let output = start_role(arguments)?.wait_with_output()?;
    if !output.status.success() {
        return Err(format!("{arguments:?} failed").into());
    }
    let text = String::from_utf8(output.stdout)?;
    Ok(text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?)
}

fn publish(registry: &str, len: usize) -> Result<(), Failure> {
    let options =
        NodeOptions { name: "load".into(), kind: "load".into(), registry: registry.into() };
    let name = |output: usize| format!("image{output}");
    let node = SystemNode::start(&options, Duration::from_secs(5), |armor| {
        (0..OUTPUTS).try_for_each(|output| Ok(armor.provide::<CompressedImage>(&name(output))?))
    })?;
    let armor = node.armor();
    // Bytes that do not compress.
    let mut seed = 1_u64;
    let mut byte = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 56) as u8
    };
    let data: Vec<u8> = (0..len).map(|_| byte()).collect();
    let mut image =
        CompressedImage { format: "jpeg".into(), data: data.into(), ..Default::default() };
    let period = Duration::from_secs(1) / RATE_HZ;
    let mut next = Instant::now();
    loop {
        for output in 0..OUTPUTS {
            image.stamp = armor.timestamp();
            armor.send_data(&name(output), &image)?;
        }
        next += period;
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
}

fn record(registry: &str, file: &str, seconds: f64) -> Result<(), Failure> {
    let observed = ObservedSystem::at(registry, "record");
    let options = RecorderOptions {
        selection: OutputSelection::default(),
        path: RecordingPath::New(file.into()),
        compression: Compression::None,
        limits: SplitLimits::default(),
        duration: Some(Duration::from_secs_f64(seconds)),
        least_free: 0,
    };
    let mut recorder = Recorder::begin(&observed, None, options)?;
    recorder.record_until(|_, _| true)?;
    let report = recorder.finish()?;
    println!("{} {} {} {}", report.messages, report.lost, report.seconds, cpu_s());
    Ok(())
}

/// Writes the messages of a recording with the crate `mcap` and nothing else, from memory: the first
/// ones, which no cache holds, again and again. `is_paced` means at the rate of the load.
fn write_again(file: &str, source: &str, count: usize, is_paced: bool) -> Result<(), Failure> {
    let mut bytes = Vec::new();
    File::open(source)?.take(SOURCE_LEN).read_to_end(&mut bytes)?;
    let messages: Vec<_> = mcap::MessageStream::new(&bytes)?.map_while(Result::ok).collect();
    let before_s = cpu_s();
    let (start, mut next) = (Instant::now(), 0);
    let mut writer = begin_alone(file)?;
    let mut channels = BTreeMap::new();
    for message in messages.iter().cycle().take(count * RECORDS_PER_MESSAGE) {
        next += 1;
        if is_paced && next % (OUTPUTS * RECORDS_PER_MESSAGE) == 0 {
            let due = start + Duration::from_secs(1) / RATE_HZ * (next / OUTPUTS / 2) as u32;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        let channel_id = match channels.get(&message.channel.id) {
            Some(known) => *known,
            None => {
                let channel = &message.channel;
                let (name, encoding, data) = channel
                    .schema
                    .as_ref()
                    .map_or((String::new(), String::new(), Vec::new()), |it| {
                        (it.name.clone(), it.encoding.clone(), it.data.to_vec())
                    });
                let schema = writer.add_schema(&name, &encoding, &data)?;
                let (topic, encoding) = (&channel.topic, &channel.message_encoding);
                let id = writer.add_channel(schema, topic, encoding, &channel.metadata)?;
                channels.insert(channel.id, id);
                id
            }
        };
        let (log_time, publish_time) = (message.log_time, message.publish_time);
        let sequence = message.sequence;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, &message.data)?;
    }
    finish_alone(writer)?;
    println!("{}", cpu_s() - before_s);
    Ok(())
}

/// Writes so many messages of one buffer, which stays in the caches of the core.
fn write_one_buffer(file: &str, count: u64) -> Result<(), Failure> {
    let mut writer = begin_alone(file)?;
    let channels = (0..OUTPUTS).map(|output| {
        let schema = writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"")?;
        writer.add_channel(schema, &format!("image{output}"), "cdr", &BTreeMap::new())
    });
    let channels = channels.collect::<Result<Vec<_>, _>>()?;
    let data = vec![7; MESSAGE_LEN];
    for number in 0..count {
        let channel_id = channels[number as usize % OUTPUTS];
        let time = number * 500_000;
        let sequence = number as u32;
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data)?;
    }
    finish_alone(writer)?;
    println!("{}", cpu_s());
    Ok(())
}

type AloneWriter = mcap::Writer<BufWriter<File>>;

fn begin_alone(file: &str) -> Result<AloneWriter, Failure> {
    let sink = BufWriter::with_capacity(1 << 20, File::create_new(file)?);
    let options = mcap::WriteOptions::new().compression(None).chunk_size(Some(CHUNK_LEN));
    Ok(options.create(sink)?)
}

fn finish_alone(mut writer: AloneWriter) -> Result<(), Failure> {
    writer.finish()?;
    Ok(writer.into_inner().into_inner()?.sync_all()?)
}

/// Processor time of this process so far, of the user and of the kernel.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 / 1e9
}

fn measure_load(folder: &Path) -> Result<(), Failure> {
    let (ours, alone) = (folder.join("load.mcap"), folder.join("alone.mcap"));
    let paths = [&ours, &alone].map(|path| path.display().to_string());
    println!(
        "load: {OUTPUTS} outputs of {MESSAGE_LEN} bytes at {RATE_HZ} Hz, in {}",
        folder.display()
    );
    let run_number = |arguments: &[&str]| -> Result<f64, Failure> {
        std::fs::remove_file(&alone).or_else(|error| match error.kind() {
            std::io::ErrorKind::NotFound => Ok(()),
            _ => Err(error),
        })?;
        run_role(arguments)?.first().copied().ok_or_else(|| "no result".into())
    };
    // Memory that a virtual machine uses for the first time is fetched from its host, which would count
    // for the first writer: as much as both files need is used once.
    run_number(&["write-one", &paths[1], "40000"])?;
    for round in 1..=ROUNDS {
        let load = Load::start(MESSAGE_LEN)?;
        let seconds = LOAD_FOR.as_secs_f64().to_string();
        let result = run_role(&["record", &load.registry, &paths[0], &seconds])?;
        drop(load);
        let [messages, lost, seconds, cpu] = result[..] else { return Err("no result".into()) };
        let count = messages.to_string();
        let again = run_number(&["write", &paths[1], &paths[0], &count])?;
        let paced = run_number(&["write-paced", &paths[1], &paths[0], &count])?;
        let one = run_number(&["write-one", &paths[1], &count])?;
        println!(
            "  round {round}: {:.0} MB/s for {seconds:.1} s, {lost} of {messages} lost; {cpu:.2} s of \
             processor time; mcap alone with the same bytes {again:.2} s: {:.2} times; at the same rate \
             {paced:.2} s: {:.2} times; with one buffer of the same length {one:.2} s: {:.2} times",
            messages * MESSAGE_LEN as f64 / seconds / 1e6,
            cpu / again,
            cpu / paced,
            cpu / one
        );
        paths.iter().try_for_each(std::fs::remove_file)?;
    }
    Ok(())
}

fn measure_kills(folder: &Path) -> Result<(), Failure> {
    let load = Load::start(SMALL_LEN)?;
    let path = folder.join("killed.mcap");
    let shown = path.display().to_string();
    let (mut opened, mut missing_s) = (0, Vec::new());
    for number in 0..KILLS {
        let mut recorder = start_role(&["record", &load.registry, &shown, "1000"])?;
        while !path.exists() {
            std::thread::sleep(Duration::from_millis(1));
        }
        // At all moments between two flushes.
        std::thread::sleep(Duration::from_millis(1500 + u64::from(number) * 5));
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64();
        kill_process(rustix::process::Pid::from_child(&recorder), Signal::KILL)?;
        recorder.wait()?;
        if let Ok(recording) = Recording::open(&path) {
            opened += 1;
            missing_s.extend(recording.summary().span_s.map(|(_, last_s)| now_s - last_s));
        }
        std::fs::remove_file(&path)?;
    }
    missing_s.sort_by(f64::total_cmp);
    println!(
        "kills: {opened} of {KILLS} files open; missing before the kill: median {:.2} s, at most {:.2} s",
        missing_s[missing_s.len() / 2],
        missing_s.last().copied().unwrap_or_default()
    );
    Ok(())
}

fn measure_seek(folder: &Path) -> Result<(), Failure> {
    let path = folder.join("large.mcap");
    let load = Load::start(MESSAGE_LEN)?;
    run_role(&["record", &load.registry, &path.display().to_string(), "6"])?;
    drop(load);
    let len = path.metadata()?.len();
    for how in ["from the disk", "in the page cache"] {
        if how == "from the disk" {
            let file = File::open(&path)?;
            file.sync_all()?;
            fadvise(&file, 0, None, Advice::DontNeed)?;
        }
        let start = Instant::now();
        let mut recording = Recording::open(&path)?;
        let opened = start.elapsed();
        let span = recording.summary().span_s.ok_or("an empty recording")?;
        let middle_s = span.0.midpoint(span.1);
        let start = Instant::now();
        recording.seek(middle_s)?;
        let first = std::iter::from_fn(|| recording.next_message().ok().flatten())
            .find(|message| message.head.stamp_s >= middle_s);
        let sought = start.elapsed();
        println!(
            "large: {:.2} GB {how}: summary {:.1} ms, middle and first message {:.1} ms ({})",
            len as f64 / 1e9,
            opened.as_secs_f64() * 1e3,
            sought.as_secs_f64() * 1e3,
            first.map_or_else(|| "none".into(), |message| message.data)
        );
    }
    // The rest is read, so that the file is known to be whole.
    let mut recording = Recording::open(&path)?;
    let start = Instant::now();
    let count = std::iter::from_fn(|| recording.next_message().ok().flatten()).count();
    println!("large: all {count} messages read in {:.1} s", start.elapsed().as_secs_f64());
    std::fs::remove_file(&path)?;
    Ok(())
}
