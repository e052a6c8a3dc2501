//! Messages as ROS 1 has them: their names, their definitions, and the checksums (MD5) by which its
//! subscribers know a type. Pure.

use std::collections::BTreeMap;

use md5::{Digest, Md5};

use super::RosMessage;

const TIME: &str = "builtin_interfaces/Time";
const HEADER: &str = "std_msgs/Header";
const HEADER_FIELDS: [&str; 3] = ["uint32 seq", "time stamp", "string frame_id"];
/// The types that are no messages.
const PLAIN: [&str; 13] = [
    "bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32",
    "float64", "string", "time",
];

/// A type of messages in ROS 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ros1Type {
    /// `sensor_msgs/LaserScan`.
    pub name: String,
    /// Its fields, and those of the types in it.
    pub definition: String,
    /// By which a subscriber compares it.
    pub md5: String,
}

/// The lines of each type in a definition, the message itself first.
struct Definitions<'a> {
    order: Vec<&'a str>,
    lines: BTreeMap<&'a str, Vec<String>>,
}

impl Ros1Type {
    /// The type of a message.
    pub fn of(message: &RosMessage) -> Self {
        let name = message.name().replace("/msg/", "/");
        let definitions = Definitions::read(&name, message.definition());
        let definition = definitions.write();
        let md5 = definitions.sum(&name, 0);
        Self { name, definition, md5 }
    }
}

impl<'a> Definitions<'a> {
    /// Reads a definition of ROS 2, and has the fields that ROS 1 has in their place.
    fn read(name: &'a str, text: &'a str) -> Self {
        let mut found = Self { order: vec![name], lines: BTreeMap::new() };
        let mut present = name;
        for line in text.lines().map(str::trim).filter(|it| !it.is_empty() && !it.starts_with('='))
        {
            if let Some(next) = line.strip_prefix("MSG: ") {
                present = next;
                if next != TIME && !found.order.contains(&next) {
                    found.order.push(next);
                }
            } else if let Some(field) = line.strip_prefix(TIME) {
                found.add(present, format!("time{field}"));
            } else {
                found.add(present, line.to_owned());
            }
        }
        if found.lines.contains_key(HEADER) {
            found.lines.insert(HEADER, HEADER_FIELDS.map(str::to_owned).to_vec());
        }
        for name in &found.order {
            let constants = list_constants(name).map(str::to_owned);
            found.lines.entry(name).or_default().splice(0..0, constants);
        }
        found
    }

    fn add(&mut self, name: &'a str, line: String) {
        self.lines.entry(name).or_default().push(line);
    }

    fn write(&self) -> String {
        let mut text = String::new();
        for (at, name) in self.order.iter().enumerate() {
            if at > 0 {
                text += &format!("{}\nMSG: {name}\n", "=".repeat(80));
            }
            for line in self.lines.get(name).into_iter().flatten() {
                text += line;
                text.push('\n');
            }
        }
        text
    }

    /// The checksum of a type: over its constants and fields, with the checksums of other messages in
    /// place of their names.
    fn sum(&self, name: &str, depth: usize) -> String {
        let lines = self.lines.get(name).into_iter().flatten();
        let lines = lines.map(|line| line.split('#').next().unwrap_or_default().trim());
        let (constants, fields): (Vec<_>, Vec<_>) =
            lines.filter(|line| !line.is_empty()).partition(|line| line.contains('='));
        let fields = fields.into_iter().map(|line| {
            let (type_name, field) = line.split_once(' ').unwrap_or((line, ""));
            let bare = type_name.split('[').next().unwrap_or_default();
            // Types are finite; the limit is that of their text.
            if PLAIN.contains(&bare) || depth > armor_wire::schema::MAX_DEPTH {
                line.to_owned()
            } else {
                format!("{} {field}", self.sum(bare, depth + 1))
            }
        });
        let text: Vec<_> = constants.into_iter().map(str::to_owned).chain(fields).collect();
        let sum = Md5::digest(text.join("\n"));
        sum.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// The constants of a message of ROS: they are part of its checksum.
fn list_constants(name: &str) -> impl Iterator<Item = &'static str> {
    let lines = match name {
        "sensor_msgs/NavSatStatus" => {
            "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 STATUS_SBAS_FIX=1\n\
             int8 STATUS_GBAS_FIX=2\nuint16 SERVICE_GPS=1\nuint16 SERVICE_GLONASS=2\n\
             uint16 SERVICE_COMPASS=4\nuint16 SERVICE_GALILEO=8"
        }
        "sensor_msgs/NavSatFix" => {
            "uint8 COVARIANCE_TYPE_UNKNOWN=0\nuint8 COVARIANCE_TYPE_APPROXIMATED=1\n\
             uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2\nuint8 COVARIANCE_TYPE_KNOWN=3"
        }
        "sensor_msgs/BatteryState" => {
            "uint8 POWER_SUPPLY_STATUS_UNKNOWN=0\nuint8 POWER_SUPPLY_STATUS_CHARGING=1\n\
             uint8 POWER_SUPPLY_STATUS_DISCHARGING=2\nuint8 POWER_SUPPLY_STATUS_NOT_CHARGING=3\n\
             uint8 POWER_SUPPLY_STATUS_FULL=4\nuint8 POWER_SUPPLY_HEALTH_UNKNOWN=0\n\
             uint8 POWER_SUPPLY_HEALTH_GOOD=1\nuint8 POWER_SUPPLY_HEALTH_OVERHEAT=2\n\
             uint8 POWER_SUPPLY_HEALTH_DEAD=3\nuint8 POWER_SUPPLY_HEALTH_OVERVOLTAGE=4\n\
             uint8 POWER_SUPPLY_HEALTH_UNSPEC_FAILURE=5\nuint8 POWER_SUPPLY_HEALTH_COLD=6\n\
             uint8 POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE=7\n\
             uint8 POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE=8\n\
             uint8 POWER_SUPPLY_TECHNOLOGY_UNKNOWN=0\nuint8 POWER_SUPPLY_TECHNOLOGY_NIMH=1\n\
             uint8 POWER_SUPPLY_TECHNOLOGY_LION=2\nuint8 POWER_SUPPLY_TECHNOLOGY_LIPO=3\n\
             uint8 POWER_SUPPLY_TECHNOLOGY_LIFE=4\nuint8 POWER_SUPPLY_TECHNOLOGY_NICD=5\n\
             uint8 POWER_SUPPLY_TECHNOLOGY_LIMN=6"
        }
        _ => "",
    };
    lines.lines()
}

#[cfg(test)]
mod tests {
    use armor_sdk::messages::{LaserScan, Odometry, Text};
    use armor_wire::message::WireType;

    use super::*;

    fn type_of<T: WireType>() -> Ros1Type {
        Ros1Type::of(&RosMessage::new(&T::schema()))
    }

    /// The checksums are those that ROS 1 publishes for its messages.
    #[test]
    fn standard_messages_have_the_checksums_of_ros() {
        let text = type_of::<Text>();
        assert_eq!(text.name, "std_msgs/String");
        assert_eq!(text.md5, "992ce8a1687cec8c8bd883ec73ca41d1");
        assert_eq!(type_of::<LaserScan>().md5, "90c7ef2dc6895d81024acba2ac42f369");
        let odometry = type_of::<Odometry>();
        assert_eq!(odometry.md5, "cd5e73d190d741a2f92e81eda573aca7");
        assert!(!odometry.definition.contains("builtin_interfaces"), "{}", odometry.definition);
        assert!(odometry.definition.contains("MSG: std_msgs/Header\nuint32 seq\ntime stamp\n"));
    }
}
