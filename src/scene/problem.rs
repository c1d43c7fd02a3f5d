//! Values that make no sense, and the checks that find them.

use std::borrow::Cow;

use glam::DVec3;

use crate::scene::description::Rgb;
use crate::scene::error::{Entity, Location, SceneError};
use crate::scene::limits::MAX_MAGNITUDE;

/// A value that makes no sense. The caller knows the file, and maybe the line.
#[derive(Debug)]
pub(super) struct Problem {
    pub entity: Entity,
    pub field: Cow<'static, str>,
    pub found: String,
    pub expected: Cow<'static, str>,
}

impl Problem {
    pub fn new(
        entity: Entity,
        field: impl Into<Cow<'static, str>>,
        found: impl ToString,
        expected: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self { entity, field: field.into(), found: found.to_string(), expected: expected.into() }
    }

    pub fn at(self, at: Location) -> SceneError {
        SceneError::Value {
            at,
            entity: self.entity,
            field: self.field,
            found: self.found.into(),
            expected: self.expected,
        }
    }
}

pub(super) type Check = Result<(), Problem>;

pub(super) fn check_integer(entity: Entity, field: &'static str, value: i64, least: u32, most: u32) -> Check {
    if value >= i64::from(least) && value <= i64::from(most) {
        return Ok(());
    }
    Err(Problem::new(entity, field, value, format!("an integer from {least} to {most}")))
}

pub(super) fn check_positive(entity: Entity, field: &'static str, value: f64) -> Check {
    if !(value > 0.0 && value.is_finite()) {
        return Err(Problem::new(entity, field, number(value), "a finite number > 0"));
    }
    if value > MAX_MAGNITUDE {
        return Err(Problem::new(entity, field, number(value), "a number <= 1e30"));
    }
    Ok(())
}

pub(super) fn check_vector(entity: Entity, field: &'static str, value: DVec3) -> Check {
    if in_range(value) {
        return Ok(());
    }
    Err(Problem::new(entity, field, vector(value), "three finite numbers of magnitude <= 1e30"))
}

pub(super) fn check_non_negative(entity: Entity, field: &'static str, value: Rgb) -> Check {
    if value.iter().all(|&x| (0.0..=MAX_MAGNITUDE).contains(&x)) {
        return Ok(());
    }
    Err(Problem::new(entity, field, vector(value.into()), "three finite numbers >= 0 (and <= 1e30)"))
}

/// Whether all components are finite and of usable magnitude.
pub(super) fn in_range(v: DVec3) -> bool {
    // NaN compares false.
    v.to_array().iter().all(|x| x.abs() <= MAX_MAGNITUDE)
}

/// A number as one would write it in a scene file.
pub(super) fn number(x: f64) -> String {
    let plain = x == 0.0 || (1e-4..1e15).contains(&x.abs());
    if plain || !x.is_finite() { x.to_string() } else { format!("{x:e}") }
}

/// A vector as one would write it in a scene file.
pub(super) fn vector(v: DVec3) -> String {
    format!("[{}]", v.to_array().map(number).join(", "))
}
