//! Values that a scene file writes in more than one way: arrays of numbers, and words in place of numbers.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, IntoDeserializer, SeqAccess, Unexpected, Visitor};

/// A number, or a word for another value.
#[derive(Clone, Copy)]
pub(super) enum FocusValue {
    Distance(f64),
    Target,
}

#[derive(Clone, Copy)]
pub(super) enum ExposureValue {
    Stops(f64),
    Auto,
}

pub(super) enum GammaValue {
    Number(f64),
    Srgb,
}

pub(super) enum RouletteValue {
    /// The first depth that may end a path.
    From(i64),
    Off,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum WrapName {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// Along u and v; one word for both.
#[derive(Default, Clone, Copy)]
pub(super) struct WrapValue(pub [WrapName; 2]);

/// Three rows of a map to the scene: of a point (x, y, z, 1).
#[derive(Clone, Copy)]
pub(super) struct Rows(pub [[f64; 4]; 3]);

/// A point, a vector or a colour. Not a plain array, of which the `toml` crate ignores what is too much.
#[derive(Default, Clone, Copy)]
pub(super) struct Triple(pub [f64; 3]);

/// So many numbers, or one for all.
#[derive(Clone, Copy)]
pub(super) struct Numbers<const N: usize>(pub [f64; N]);

impl<const N: usize> Default for Numbers<N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

/// Reads an array of `N` values, or, if `one` is, a single one for all.
struct ArrayVisitor<T, const N: usize> {
    one: bool,
    expecting: &'static str,
    kind: std::marker::PhantomData<T>,
}

impl<T, const N: usize> ArrayVisitor<T, N> {
    fn new(one: bool, expecting: &'static str) -> Self {
        Self { one, expecting, kind: std::marker::PhantomData }
    }
}

impl<'de, T: Deserialize<'de> + Copy + Default, const N: usize> Visitor<'de> for ArrayVisitor<T, N> {
    type Value = [T; N];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.expecting)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<[T; N], E> {
        if !self.one {
            return Err(E::invalid_type(Unexpected::Float(value), &self));
        }
        T::deserialize(value.into_deserializer()).map(|value| [value; N])
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<[T; N], E> {
        if !self.one {
            return Err(E::invalid_type(Unexpected::Signed(value), &self));
        }
        T::deserialize((value as f64).into_deserializer()).map(|value| [value; N])
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<[T; N], E> {
        if !self.one {
            return Err(E::invalid_type(Unexpected::Str(value), &self));
        }
        T::deserialize(value.into_deserializer()).map(|value| [value; N])
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<[T; N], A::Error> {
        let mut values = [T::default(); N];
        let mut count = 0;
        while let Some(value) = elements.next_element()? {
            if let Some(slot) = values.get_mut(count) {
                *slot = value;
            }
            count += 1;
        }
        if count == N { Ok(values) } else { Err(A::Error::invalid_length(count, &self)) }
    }
}

impl<'de> Deserialize<'de> for Triple {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ArrayVisitor::new(false, "an array of three numbers")).map(Self)
    }
}

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let expecting = if N == 2 { "a number or an array of two" } else { "a number or an array of three" };
        deserializer.deserialize_any(ArrayVisitor::new(true, expecting)).map(Self)
    }
}

impl<'de> Deserialize<'de> for WrapValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let expecting = "\"repeat\", \"mirror\" or \"clamp\", or an array of two of them";
        deserializer.deserialize_any(ArrayVisitor::new(true, expecting)).map(Self)
    }
}

impl<'de> Deserialize<'de> for Rows {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Default, Clone, Copy)]
        struct Row([f64; 4]);

        impl<'de> Deserialize<'de> for Row {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                deserializer.deserialize_any(ArrayVisitor::new(false, "a row of four numbers")).map(Self)
            }
        }

        let rows: [Row; 3] =
            deserializer.deserialize_any(ArrayVisitor::new(false, "an array of three rows of four numbers"))?;
        Ok(Self(rows.map(|row| row.0)))
    }
}

/// Reads a number, or the only word that may be in its place.
macro_rules! number_or_word {
    ($value:ident, $number:ident, $what:literal, $word:literal, $variant:ident) => {
        impl<'de> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct NumberOrWord;

                impl Visitor<'_> for NumberOrWord {
                    type Value = $value;

                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str(concat!($what, " or \"", $word, "\""))
                    }

                    fn visit_f64<E: Error>(self, value: f64) -> Result<$value, E> {
                        Ok($value::$number(value))
                    }

                    fn visit_i64<E: Error>(self, value: i64) -> Result<$value, E> {
                        Ok($value::$number(value as f64))
                    }

                    fn visit_str<E: Error>(self, value: &str) -> Result<$value, E> {
                        match value {
                            $word => Ok($value::$variant),
                            _ => Err(E::invalid_value(Unexpected::Str(value), &self)),
                        }
                    }
                }

                deserializer.deserialize_any(NumberOrWord)
            }
        }
    };
}

number_or_word!(GammaValue, Number, "a number > 0", "srgb", Srgb);
number_or_word!(FocusValue, Distance, "a distance > 0", "target", Target);
number_or_word!(ExposureValue, Stops, "a number of stops", "auto", Auto);

impl<'de> Deserialize<'de> for RouletteValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RouletteVisitor;

        impl Visitor<'_> for RouletteVisitor {
            type Value = RouletteValue;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an integer >= 1 or \"off\"")
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<RouletteValue, E> {
                Ok(RouletteValue::From(value))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<RouletteValue, E> {
                match value {
                    "off" => Ok(RouletteValue::Off),
                    _ => Err(E::invalid_value(Unexpected::Str(value), &self)),
                }
            }
        }

        deserializer.deserialize_any(RouletteVisitor)
    }
}
