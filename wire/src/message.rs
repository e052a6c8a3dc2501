//! What can travel: every field type knows its schema, every message type its name as well.

use bincode::{Decode, Encode};

use crate::schema::Schema;

/// A type that can be part of a message. Derived by `#[derive(Message)]`.
pub trait WireType: Encode + Decode<()> + 'static {
    /// The fewest bytes a value takes. Never 0, so that no list length is free.
    const MIN_LEN: usize;
    /// The layout of the type.
    fn schema() -> Schema;
}

/// A type that an output may publish.
pub trait Message: WireType + Send {
    /// The name of the type as shown to people and compared at link time.
    const NAME: &'static str;
}

macro_rules! primitive {
    ($($rust:ty => $schema:ident, $len:expr;)*) => {$(
        impl WireType for $rust {
            const MIN_LEN: usize = $len;
            fn schema() -> Schema {
                Schema::$schema
            }
        }
    )*};
}

primitive! {
    bool => Bool, 1;
    u8 => U8, 1;
    i8 => I8, 1;
    u16 => U16, 2;
    i16 => I16, 2;
    u32 => U32, 4;
    i32 => I32, 4;
    u64 => U64, 8;
    i64 => I64, 8;
    f32 => F32, 4;
    f64 => F64, 8;
    String => Text, 8;
}

impl<T: WireType> WireType for Vec<T> {
    const MIN_LEN: usize = {
        assert!(T::MIN_LEN > 0, "a list of values without bytes has no length that can be checked");
        8
    };
    fn schema() -> Schema {
        Schema::List(Box::new(T::schema()))
    }
}

impl<T: WireType> WireType for Option<T> {
    const MIN_LEN: usize = 1;
    fn schema() -> Schema {
        Schema::Option(Box::new(T::schema()))
    }
}

impl<T: WireType, const N: usize> WireType for [T; N] {
    const MIN_LEN: usize = N * T::MIN_LEN;
    fn schema() -> Schema {
        Schema::Fixed(Box::new(T::schema()), N)
    }
}

impl<T: WireType> WireType for Box<T> {
    const MIN_LEN: usize = T::MIN_LEN;
    fn schema() -> Schema {
        T::schema()
    }
}
