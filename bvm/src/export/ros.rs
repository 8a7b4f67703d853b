//! Messages of ROS 2, serialised as CDR (OMG's Common Data Representation, little-endian).
//!
//! In: values. Out: bytes, and the definition of each message with those that it depends on. Invariant: a number is
//! aligned to its size, counted from the end of the four bytes that name the encoding.

use super::Point;

/// A message type.
pub(super) struct Schema {
    /// Its name.
    pub(super) name: &'static str,
    /// Its definition, followed by its dependencies.
    pub(super) definition: &'static str,
}

macro_rules! dependency {
    ($name:literal, $definition:literal) => {
        concat!(
            "================================================================================\nMSG: ",
            $name,
            "\n",
            $definition
        )
    };
}

macro_rules! time {
    () => {
        dependency!("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n")
    };
}

macro_rules! header {
    () => {
        concat!(dependency!("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"), time!())
    };
}

macro_rules! vector {
    () => {
        dependency!("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n")
    };
}

macro_rules! quaternion {
    () => {
        dependency!("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n")
    };
}

/// The points of the map.
pub(super) const CLOUD: Schema = Schema {
    name: "sensor_msgs/msg/PointCloud2",
    definition: concat!(
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n\
         bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
        header!(),
        dependency!(
            "sensor_msgs/PointField",
            "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n\
             uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n"
        )
    ),
};

/// Transforms.
pub(super) const TRANSFORMS: Schema = Schema {
    name: "tf2_msgs/msg/TFMessage",
    definition: concat!(
        "geometry_msgs/TransformStamped[] transforms\n",
        dependency!(
            "geometry_msgs/TransformStamped",
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
        ),
        header!(),
        dependency!(
            "geometry_msgs/Transform",
            "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
        ),
        vector!(),
        quaternion!()
    ),
};

/// The gaze: a pose at the head that looks along x.
pub(super) const POSE: Schema = Schema {
    name: "geometry_msgs/msg/PoseStamped",
    definition: concat!(
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
        header!(),
        dependency!(
            "geometry_msgs/Pose",
            "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"
        ),
        dependency!("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
        quaternion!()
    ),
};

/// A number over time.
pub(super) const NUMBER: Schema = Schema { name: "std_msgs/msg/Float64", definition: "float64 data\n" };

/// A buffer.
pub(super) struct Cdr(Vec<u8>);

impl Cdr {
    /// Little-endian CDR.
    pub(super) fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn align(&mut self, size: usize) {
        let past = (self.0.len() - 4) % size;
        if past > 0 {
            self.0.resize(self.0.len() + size - past, 0);
        }
    }

    fn byte(&mut self, value: u8) -> &mut Self {
        self.0.push(value);
        self
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.align(4);
        self.0.extend(value.to_le_bytes());
        self
    }

    /// A number.
    pub(super) fn f64(&mut self, value: f64) -> &mut Self {
        self.align(8);
        self.0.extend(value.to_le_bytes());
        self
    }

    fn string(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.byte(0)
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(bytes.len() as u32);
        self.0.extend(bytes);
        self
    }

    /// A stamp and the name of a frame, which has no leading slash.
    pub(super) fn header(&mut self, stamp_ns: u64, frame: &str) -> &mut Self {
        self.u32((stamp_ns / 1_000_000_000) as u32).u32((stamp_ns % 1_000_000_000) as u32).string(frame)
    }

    /// The message.
    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }
}

/// A cloud in a frame.
pub(super) fn cloud(stamp_ns: u64, frame: &str, points: &[Point]) -> Vec<u8> {
    const FIELDS: [&str; 7] = ["x", "y", "z", "occupancy", "velocity_x", "velocity_y", "velocity_z"];
    const FLOAT32: u8 = 7;
    let step = 4 * FIELDS.len() as u32;
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame).u32(1).u32(points.len() as u32).u32(FIELDS.len() as u32);
    for (at, name) in FIELDS.iter().enumerate() {
        cdr.string(name).u32(4 * at as u32).byte(FLOAT32).u32(1);
    }
    let numbers = points
        .iter()
        .flat_map(|point| point.place.into_iter().chain([point.occupancy]).chain(point.velocity));
    let data: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    // Dense: no point has a NaN.
    cdr.byte(0).u32(step).u32(step * points.len() as u32).bytes(&data).byte(1);
    cdr.finish()
}

/// A rotation as a quaternion x, y, z, w.
pub(super) type Quaternion = [f64; 4];

/// Transforms from frames to their parents: parent, child, translation in metres, rotation.
pub(super) fn transforms(stamp_ns: u64, all: &[(&str, &str, [f64; 3], Quaternion)]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.u32(all.len() as u32);
    for (parent, child, translation, rotation) in all {
        cdr.header(stamp_ns, parent).string(child);
        translation.iter().chain(rotation).for_each(|part| {
            cdr.f64(*part);
        });
    }
    cdr.finish()
}

/// A pose in a frame.
pub(super) fn pose(stamp_ns: u64, frame: &str, position: [f64; 3], orientation: Quaternion) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame);
    position.iter().chain(&orientation).for_each(|part| {
        cdr.f64(*part);
    });
    cdr.finish()
}
