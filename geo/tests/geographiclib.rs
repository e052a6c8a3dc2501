//! 10,000 random positions within 100 km against GeographicLib's programs, if they are installed
//! (Debian: geographiclib-tools); the values in golden.csv are always compared.

use std::io::Write;
use std::process::{Command, Stdio};

use armor_geo::{EcefPosition, EnuFrame, EnuPosition, GeoPosition, UtmZone};

const ORIGINS: usize = 20;
const POSITIONS_PER_ORIGIN: usize = 500;
const TOLERANCE_M: f64 = 1e-4;

/// The lines that a program prints for the lines of `input`; none if it is not installed.
fn ask(program: &str, arguments: &[String], input: &str) -> Option<Vec<String>> {
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .ok()?;
    let mut stdin = child.stdin.take().expect("a pipe");
    let input = input.to_owned();
    let writer =
        std::thread::spawn(move || stdin.write_all(input.as_bytes()).expect("the program reads"));
    let output = child.wait_with_output().expect("the program ends");
    writer.join().expect("the writer ends");
    assert!(output.status.success(), "{program} {arguments:?}");
    Some(String::from_utf8(output.stdout).expect("text").lines().map(str::to_owned).collect())
}

fn numbers(line: &str) -> Vec<f64> {
    line.split(' ').map(|word| word.parse().unwrap_or(f64::NAN)).collect()
}

fn distance_m(a: GeoPosition, b: GeoPosition) -> f64 {
    let (a, b) = (EcefPosition::from(a), EcefPosition::from(b));
    (a.x_m - b.x_m).hypot(a.y_m - b.y_m).hypot(a.z_m - b.z_m)
}

fn random_near(origin: GeoPosition, random: &mut fastrand::Rng) -> GeoPosition {
    let (reach_m, angle) = (100_000.0 * random.f64().sqrt(), std::f64::consts::TAU * random.f64());
    let enu = EnuPosition {
        east_m: reach_m * angle.cos(),
        north_m: reach_m * angle.sin(),
        up_m: 2_000.0 * (random.f64() - 0.5),
    };
    EnuFrame::new(origin).geo_from_enu(enu).expect("valid")
}

#[test]
fn positions_within_100_km_are_converted_as_by_cartconvert_and_geoconvert() {
    let mut random = fastrand::Rng::with_seed(2011);
    let (mut worst, mut compared) = ([0.0_f64; 6], 0);
    let precision = ["-p", "9"].map(str::to_owned).to_vec();
    for _ in 0..ORIGINS {
        let origin =
            GeoPosition::new(158.0 * random.f64() - 79.0, 360.0 * random.f64(), 0.0).unwrap();
        let positions: Vec<_> =
            (0..POSITIONS_PER_ORIGIN).map(|_| random_near(origin, &mut random)).collect();
        let line = |p: &GeoPosition| {
            format!("{:?} {:?} {:?}\n", p.latitude_deg(), p.longitude_deg(), p.height_m())
        };
        let input: String = positions.iter().map(line).collect();
        let mut local = precision.clone();
        local.extend(["-l".into()]);
        local.extend(line(&origin).split_whitespace().map(str::to_owned));
        let Some(enus) = ask("CartConvert", &local, &input) else {
            println!("CartConvert is not installed (geographiclib-tools); not compared");
            return;
        };
        let ecefs = ask("CartConvert", &precision, &input).unwrap();
        let flat: String = positions
            .iter()
            .map(|p| format!("{:?} {:?}\n", p.latitude_deg(), p.longitude_deg()))
            .collect();
        let mut grid = precision.clone();
        grid.push("-u".into());
        let grids = ask("GeoConvert", &grid, &flat).unwrap();
        assert_eq!((enus.len(), ecefs.len(), grids.len()), (500, 500, 500));

        let frame = EnuFrame::new(origin);
        for (index, &position) in positions.iter().enumerate() {
            let [ex, ey, ez] = numbers(&ecefs[index])[..] else { panic!("{}", ecefs[index]) };
            let ecef = EcefPosition::from(position);
            let golden = EcefPosition { x_m: ex, y_m: ey, z_m: ez };
            let [east_m, north_m, up_m] = numbers(&enus[index])[..] else { panic!() };
            let enu = frame.enu_from_geo(position);
            let golden_enu = EnuPosition { east_m, north_m, up_m };
            let [_, easting_m, northing_m] = numbers(&grids[index])[..] else { panic!() };
            let zone = UtmZone::of(position).unwrap();
            let name = grids[index].split(' ').next().unwrap();
            assert_eq!(format!("{:0>3}", zone.to_string()), name);
            let utm = zone.utm_from_geo(position).unwrap();
            let differences = [
                (ecef.x_m - ex).hypot(ecef.y_m - ey).hypot(ecef.z_m - ez),
                distance_m(GeoPosition::try_from(golden).unwrap(), position),
                (enu.east_m - east_m).hypot(enu.north_m - north_m).hypot(enu.up_m - up_m),
                distance_m(frame.geo_from_enu(golden_enu).unwrap(), position),
                (utm.easting_m - easting_m).hypot(utm.northing_m - northing_m),
                distance_m(
                    zone.geo_from_utm(easting_m, northing_m, position.height_m()).unwrap(),
                    position,
                ),
            ];
            for (worst, difference) in worst.iter_mut().zip(differences) {
                *worst = worst.max(difference);
            }
            compared += 1;
        }
    }
    println!("{compared} positions; largest differences in metres:");
    for (what, worst) in
        ["to ECEF", "from ECEF", "to ENU", "from ENU", "to UTM", "from UTM"].iter().zip(worst)
    {
        println!("{what:10} {worst:.1e}");
        assert!(worst <= TOLERANCE_M, "{what}: {worst} m");
    }
    assert_eq!(compared, ORIGINS * POSITIONS_PER_ORIGIN);
}
