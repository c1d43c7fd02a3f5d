//! Random numbers of the cases: the oracle's generator, which the shaders do not use.

use glam::{DVec3, Vec3};

use crate::oracle::Pcg64;

/// Draws of points and directions.
pub(crate) struct Rng(Pcg64);

impl Rng {
    /// Equal seeds give equal numbers.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::for_pixel(seed, 0x0063_6865_636b))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.uniform()
    }

    /// Uniform in [a, b).
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.uniform()
    }

    /// Uniform below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.uniform() * n as f64) as usize).min(n - 1)
    }

    /// 32 random bits.
    pub fn bits(&mut self) -> u32 {
        (self.0.next_u64() >> 32) as u32
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = (std::f64::consts::TAU * self.uniform()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    /// The same, rounded to single precision: its length is 1 but for rounding.
    pub fn direction32(&mut self) -> Vec3 {
        self.direction().as_vec3()
    }

    /// Uniform in a cube around 0.
    pub fn in_cube(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.between(-half, half), self.between(-half, half), self.between(-half, half))
    }

    /// Uniform in the unit ball.
    pub fn in_ball(&mut self) -> DVec3 {
        self.direction() * self.uniform().cbrt()
    }
}
