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

/// Mean over a cell of what is between the pixels, summed over channels: exactly, so that it is 0 only where nothing shines.
fn mean_of_cell(map: &Environment, column: usize, row: usize) -> f64 {
    let (width, height) = (map.width as usize, map.height as usize);
    let across = weights(column, COLUMNS, width);
    let brightness = |i: isize, j: isize| {
        let i = i.rem_euclid(width as isize) as usize;
        let j = j.clamp(0, height as isize - 1) as usize;
        map.texels[j * width + i].iter().map(|&x| f64::from(x)).sum::<f64>()
    };
    let of_row = |j| across.clone().map(|(i, weight)| weight * brightness(i, j)).sum::<f64>();
    weights(row, ROWS, height).map(|(j, weight)| weight * of_row(j)).sum()
}

/// Pixels along an axis that a cell sees, and by how much: means of linear interpolation's hats over the cell.
fn weights(cell: usize, cells: usize, pixels: usize) -> impl Iterator<Item = (isize, f64)> + Clone {
    let edge = |cell: usize| cell as f64 / cells as f64 * pixels as f64 - 0.5;
    let (first, last) = (edge(cell), edge(cell + 1));
    let integral = move |x: f64| match x.clamp(-1.0, 1.0) {
        x if x < 0.0 => (1.0 + x) * (1.0 + x) / 2.0,
        x => 1.0 - (1.0 - x) * (1.0 - x) / 2.0,
    };
    let weight = move |i: isize| (integral(last - i as f64) - integral(first - i as f64)) / (last - first);
    (first.floor() as isize..=last.ceil() as isize).map(move |i| (i, weight(i))).filter(|(_, weight)| *weight > 0.0)
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

    #[test]
    fn no_cell_that_shines_is_left_out() {
        // Of a size that is no multiple of the cells, a pixel's light reaches a little into cells beside it.
        let (width, height) = (1000, 500);
        for column in 180..200 {
            let mut texels = vec![[0.0; 3]; width * height];
            texels[250 * width + column] = [1e5; 3];
            let map = Environment { width: 1000, height: 500, texels: texels.into(), ..Environment::studio() };
            // The pixel reaches from the centre of the one before to that of the one after.
            let reach = [column as f64 - 0.5, column as f64 + 1.5].map(|x| x / width as f64 * COLUMNS as f64);
            let rows = [249.5, 251.5].map(|y: f64| (y / height as f64 * ROWS as f64) as usize);
            for cell in reach[0] as usize..=(reach[1] - 1e-9) as usize {
                let shines = (rows[0]..=rows[1]).any(|row| mean_of_cell(&map, cell, row) > 0.0);
                assert!(shines, "column {column}, cell {cell}");
            }
        }
    }
}
