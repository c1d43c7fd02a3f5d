//! The density by which directions of an environment map are drawn: shaders/lib/light/environment.glsl.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::accel::Texel;
use crate::scene::Environment;

/// Columns and rows of cells.
const COLUMNS: usize = 512;
const ROWS: usize = 256;
/// Of all light a part is drawn evenly over the sphere: rounding must not lose what shines.
const EVEN: f64 = 1e-3;

/// What the shaders see of a map.
pub(crate) struct EnvironmentTable {
    /// Pixels, row by row.
    pub pixels: Vec<Texel>,
    /// Level by level, the parts that four quarters of a cell have of all.
    pub density: Vec<Texel>,
    /// Part of the left half.
    pub left: f32,
    /// Radiance times solid angle, summed over channels.
    pub power: f64,
}

impl EnvironmentTable {
    /// The table of a map.
    pub fn of(map: &Environment) -> Self {
        let weights: Vec<f64> = (0..COLUMNS * ROWS)
            .into_par_iter()
            .map(|cell| mean_of_cell(map, cell % COLUMNS, cell / COLUMNS) * solid_angle(cell / COLUMNS))
            .collect();
        let power: f64 = weights.iter().sum();
        let part = |(cell, weight): (usize, &f64)| {
            let even = solid_angle(cell / COLUMNS) / (4.0 * PI);
            if power > 0.0 { (1.0 - EVEN) * weight / power + EVEN * even } else { even }
        };
        let mut parts: Vec<f64> = weights.iter().enumerate().map(part).collect();
        let (mut columns, mut rows) = (COLUMNS, ROWS);
        let mut levels = Vec::new();
        while rows > 1 {
            let quarters = |cell: usize| {
                let (x, y) = (2 * (cell % (columns / 2)), 2 * (cell / (columns / 2)));
                [
                    parts[y * columns + x],
                    parts[y * columns + x + 1],
                    parts[(y + 1) * columns + x],
                    parts[(y + 1) * columns + x + 1],
                ]
            };
            let four: Vec<[f64; 4]> = (0..columns * rows / 4).map(quarters).collect();
            parts = four.iter().map(|four| four.iter().sum()).collect();
            levels.push(four);
            (columns, rows) = (columns / 2, rows / 2);
        }
        let density = levels.iter().rev().flatten().map(|four| four.map(|x| (x as f32).to_bits())).collect();
        let pixels = map.texels.iter().map(|&[r, g, b]| [r, g, b, 0.0].map(f32::to_bits)).collect();
        Self { pixels, density, left: parts[0] as f32, power: power * map.scale }
    }
}

/// Of a cell of a row.
fn solid_angle(row: usize) -> f64 {
    let edge = |row: usize| (PI * row as f64 / ROWS as f64).cos();
    2.0 * PI * (edge(row) - edge(row + 1)) / COLUMNS as f64
}

/// Mean over a cell of what is between the pixels, summed over channels.
fn mean_of_cell(map: &Environment, column: usize, row: usize) -> f64 {
    let (width, height) = (map.width as usize, map.height as usize);
    // At least two samples a pixel.
    let samples = |pixels: usize, cells: usize| (2 * pixels).div_ceil(cells).max(2);
    let (across, down) = (samples(width, COLUMNS), samples(height, ROWS));
    let pixel = |i: isize, j: isize| {
        let i = i.rem_euclid(width as isize) as usize;
        let j = j.clamp(0, height as isize - 1) as usize;
        map.texels[j * width + i].iter().map(|&x| f64::from(x)).sum::<f64>()
    };
    let mut sum = 0.0;
    for (a, b) in (0..down).flat_map(|b| (0..across).map(move |a| (a, b))) {
        let place = |cell: usize, k: usize, n: usize, cells: usize, pixels: usize| {
            (cell as f64 + (k as f64 + 0.5) / n as f64) / cells as f64 * pixels as f64 - 0.5
        };
        let (x, y) = (place(column, a, across, COLUMNS, width), place(row, b, down, ROWS, height));
        let (i, j) = (x.floor(), y.floor());
        let (s, t) = (x - i, y - j);
        let row = |j: isize| pixel(i as isize, j) * (1.0 - s) + pixel(i as isize + 1, j) * s;
        sum += row(j as isize) * (1.0 - t) + row(j as isize + 1) * t;
    }
    sum / (across * down) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_of_all_and_bright_cells_have_most() {
        let mut map = Environment::studio();
        let table = EnvironmentTable::of(&map);
        let sum = |texels: &[Texel]| texels.as_flattened().iter().map(|&x| f64::from(f32::from_bits(x))).sum::<f64>();
        // The last level, and the first.
        assert!((sum(&table.density[table.density.len() - COLUMNS * ROWS / 4..]) - 1.0).abs() < 1e-5);
        assert!((sum(&table.density[..2]) - 1.0).abs() < 1e-5);
        assert!((table.power / (3.0 * 4.0 * PI) - 1.0).abs() < 1e-3, "the studio's mean is 1");
        let mut texels = vec![[0.0; 3]; (map.width * map.height) as usize];
        texels[(map.height / 2 * map.width + 10) as usize] = [1e5; 3];
        map.texels = texels.into();
        let table = EnvironmentTable::of(&map);
        assert!(table.left > 0.99 && table.left < 1.0);
    }
}
