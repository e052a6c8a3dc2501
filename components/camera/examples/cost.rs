//! What compressing a picture costs and saves:
//! `cargo run --release -p armor-camera --example cost FILE`.

use std::time::Instant;

use armor_camera::{Finish, Picture, SizeLimits, read};

const ROUNDS: u32 = 100;
/// Larger pictures are made as small as this first.
const MOST: SizeLimits = SizeLimits { width: 640, height: 0 };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give it a JPEG or PNG file")?;
    let small = read(&Finish { limits: MOST, quality: 100 }.file(std::fs::read(path)?)?)?;
    let (width, height) = (usize::from(small.width()), usize::from(small.height()));
    let raw_kb = small.pixels().len() as f64 / 1e3;
    println!("{width}x{height}: {raw_kb:.1} kB raw");
    for quality in [50, 80, 90, 95] {
        let finish = Finish { limits: SizeLimits::default(), quality };
        let start = Instant::now();
        let mut len = 0;
        for _ in 0..ROUNDS {
            let picture = Picture::new(width, height, small.layout(), small.pixels())?;
            len = finish.picture(picture)?.len();
        }
        let ms = start.elapsed().as_secs_f64() * 1e3 / f64::from(ROUNDS);
        let kb = len as f64 / 1e3;
        println!("quality {quality}: {ms:.2} ms, {kb:.1} kB, {:.0} times smaller", raw_kb / kb);
    }
    Ok(())
}
