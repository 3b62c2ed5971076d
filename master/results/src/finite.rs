//! Finds the first number in a serialisable value that is not finite.
//!
//! JSON has no infinities and no NaN, and serde_json writes `null` in their place without a word: a
//! summary would then hide the very number that shows that something went wrong. So the value is
//! walked first, by a serialiser that writes nothing and keeps the path of where it is.

use std::fmt::{self, Display};

use serde::Serialize;
use serde::ser::{self, Serializer};

use crate::error::Fault;

/// Refuses `value` if there is a number in it that is not finite, and says where.
pub(crate) fn check(value: &impl Serialize) -> Result<(), Fault> {
    let mut walk = Walk::default();
    match value.serialize(&mut walk) {
        Err(Stop) => match walk.found {
            Some(value) => {
                let place = walk.path;
                Err(Fault::NotFinite { place, value })
            }
            // a value that cannot be serialised at all: the JSON encoder says why
            None => Ok(()),
        },
        Ok(()) => Ok(()),
    }
}

#[derive(Default)]
struct Walk {
    /// Of the value being looked at, as in `bands[0].closure_W`.
    path: String,
    found: Option<f64>,
}

/// The walk is over before its end.
#[derive(Debug)]
struct Stop;

impl Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("walk stopped")
    }
}

impl std::error::Error for Stop {}

impl ser::Error for Stop {
    fn custom<T: Display>(_: T) -> Self {
        Self
    }
}

impl Walk {
    /// Looks at what `step` leads to; the path stays where something was found.
    fn inside<T: Serialize + ?Sized>(
        &mut self,
        step: impl FnOnce(&mut String),
        value: &T,
    ) -> Result<(), Stop> {
        let here = self.path.len();
        step(&mut self.path);
        value.serialize(&mut *self)?;
        self.path.truncate(here);
        Ok(())
    }

    fn field<T: Serialize + ?Sized>(&mut self, name: &str, value: &T) -> Result<(), Stop> {
        let step = |path: &mut String| {
            if !path.is_empty() {
                path.push('.');
            }
            path.push_str(name);
        };
        self.inside(step, value)
    }
}

/// Elements of a sequence, fields of a struct or entries of a map: what is inside is walked.
struct Inside<'a> {
    walk: &'a mut Walk,
    next: usize,
    key: String,
}

impl<'a> From<&'a mut Walk> for Inside<'a> {
    fn from(walk: &'a mut Walk) -> Self {
        let key = String::new();
        Self { walk, next: 0, key }
    }
}

impl Inside<'_> {
    fn element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stop> {
        let index = self.next;
        self.next += 1;
        let step = |path: &mut String| path.push_str(&format!("[{index}]"));
        self.walk.inside(step, value)
    }
}

macro_rules! nothing_to_see {
    ($($method:ident($($kind:ty),*);)*) => {
        $(fn $method(self, $(_: $kind),*) -> Result<(), Stop> { Ok(()) })*
    };
}

macro_rules! go_inside {
    ($($method:ident($($kind:ty),*);)*) => {
        $(fn $method(self, $(_: $kind),*) -> Result<Inside<'a>, Stop> { Ok(self.into()) })*
    };
}

impl<'a> Serializer for &'a mut Walk {
    type Ok = ();
    type Error = Stop;
    type SerializeSeq = Inside<'a>;
    type SerializeTuple = Inside<'a>;
    type SerializeTupleStruct = Inside<'a>;
    type SerializeTupleVariant = Inside<'a>;
    type SerializeMap = Inside<'a>;
    type SerializeStruct = Inside<'a>;
    type SerializeStructVariant = Inside<'a>;

    fn serialize_f64(self, value: f64) -> Result<(), Stop> {
        if value.is_finite() {
            return Ok(());
        }
        self.found = Some(value);
        Err(Stop)
    }

    fn serialize_f32(self, value: f32) -> Result<(), Stop> {
        self.serialize_f64(value.into())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Stop> {
        value.serialize(self)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), Stop> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Stop> {
        self.field(variant, value)
    }

    nothing_to_see! {
        serialize_bool(bool);
        serialize_i8(i8);
        serialize_i16(i16);
        serialize_i32(i32);
        serialize_i64(i64);
        serialize_i128(i128);
        serialize_u8(u8);
        serialize_u16(u16);
        serialize_u32(u32);
        serialize_u64(u64);
        serialize_u128(u128);
        serialize_char(char);
        serialize_str(&str);
        serialize_bytes(&[u8]);
        serialize_none();
        serialize_unit();
        serialize_unit_struct(&'static str);
        serialize_unit_variant(&'static str, u32, &'static str);
    }

    go_inside! {
        serialize_seq(Option<usize>);
        serialize_tuple(usize);
        serialize_tuple_struct(&'static str, usize);
        serialize_tuple_variant(&'static str, u32, &'static str, usize);
        serialize_map(Option<usize>);
        serialize_struct(&'static str, usize);
        serialize_struct_variant(&'static str, u32, &'static str, usize);
    }
}

macro_rules! elements {
    ($($kind:ident::$method:ident;)*) => {
        $(impl ser::$kind for Inside<'_> {
            type Ok = ();
            type Error = Stop;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stop> {
                self.element(value)
            }
            fn end(self) -> Result<(), Stop> {
                Ok(())
            }
        })*
    };
}

elements! {
    SerializeSeq::serialize_element;
    SerializeTuple::serialize_element;
    SerializeTupleStruct::serialize_field;
    SerializeTupleVariant::serialize_field;
}

macro_rules! fields {
    ($($kind:ident;)*) => {
        $(impl ser::$kind for Inside<'_> {
            type Ok = ();
            type Error = Stop;
            fn serialize_field<T: Serialize + ?Sized>(
                &mut self,
                name: &'static str,
                value: &T,
            ) -> Result<(), Stop> {
                self.walk.field(name, value)
            }
            fn end(self) -> Result<(), Stop> {
                Ok(())
            }
        })*
    };
}

fields! {
    SerializeStruct;
    SerializeStructVariant;
}

impl ser::SerializeMap for Inside<'_> {
    type Ok = ();
    type Error = Stop;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Stop> {
        let text = serde_json::to_string(key).map_err(|_| Stop)?;
        self.key = text.trim_matches('"').to_owned();
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stop> {
        let key = std::mem::take(&mut self.key);
        self.walk.field(&key, value)
    }

    fn end(self) -> Result<(), Stop> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[derive(Serialize)]
    enum Shape {
        Empty,
        Round(f64),
        Pair(f64, f64),
        Named { x: Option<f32> },
    }

    fn place(value: &impl Serialize) -> Option<String> {
        match check(value) {
            Err(Fault::NotFinite { place, .. }) => Some(place),
            _ => None,
        }
    }

    #[test]
    fn finite_values_pass() {
        let value = (
            1.0,
            "NaN",
            None::<f64>,
            [Shape::Empty, Shape::Round(0.5)],
            BTreeMap::from([(1, 2.0)]),
        );
        assert_eq!(place(&value), None);
    }

    #[test]
    fn what_is_not_finite_is_found_wherever_it_hides() {
        let inf = f64::INFINITY;
        let nan = f32::NAN;
        assert_eq!(place(&[1.0, inf]).as_deref(), Some("[1]"));
        assert_eq!(place(&Shape::Round(inf)).as_deref(), Some("Round"));
        assert_eq!(place(&Shape::Pair(0.0, -inf)).as_deref(), Some("[1]"));
        assert_eq!(place(&Shape::Named { x: Some(nan) }).as_deref(), Some("x"));
        let map = BTreeMap::from([
            ("ok", vec![Shape::Empty]),
            ("bad", vec![Shape::Empty, Shape::Named { x: Some(nan) }]),
        ]);
        assert_eq!(place(&map).as_deref(), Some("bad[1].x"));
        let erased: &dyn erased_serde::Serialize = &map;
        assert_eq!(place(&erased).as_deref(), Some("bad[1].x"));
    }
}
