//! Which light to choose, by where the surface is: for each cell of a grid over all of space, probabilities of lights or
//! groups of lights. See shaders/lib/light/choice.glsl.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::render::light::alias::{Column, alias_table};
use crate::render::light::emitter::FAR;
use crate::render::light::tree::{LightNode, LightTree, Link};

/// Entries of a cell, at most: among more lights than that groups are chosen.
const MOST_ENTRIES: usize = 64;
/// Entries of all cells: 4 MiB.
const ENTRIES: usize = 1 << 18;
/// Along an axis.
const MOST_CELLS: u32 = 16;
/// The least probability of what can be chosen: what is chosen less often makes bright dots.
const LEAST_SHARE: f64 = 1.0 / 65_536.0;
/// What has a smaller share (emitters that hardly have an area) stays at that.
const NEGLIGIBLE_SHARE: f64 = LEAST_SHARE * LEAST_SHARE * LEAST_SHARE;
/// Bits of the number of an entry that is not there.
const NO_KEY: u32 = i32::MAX as u32;

/// The shape of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightGrid {
    /// Cells along each axis.
    pub cells: u32,
    /// Entries of a cell, a power of two.
    pub entries: u32,
    /// Levels of the tree below what entries stand for, at most; 0: for lights.
    pub depth: u32,
    /// Of the grid.
    pub center: DVec3,
    /// Coordinates x from the centre are mapped to x/(x + size), so that cells are finest within `size`.
    pub size: f64,
}

impl Default for LightGrid {
    fn default() -> Self {
        Self { cells: 1, entries: 1, depth: 0, center: DVec3::ZERO, size: 1.0 }
    }
}

/// A choice: `own < threshold` takes the entry's own key, else that of another entry.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    threshold: f32,
    alias: u32,
    probability: f32,
    /// A light, or a node of the tree; entries are sorted by it.
    key: u32,
}

impl Entry {
    fn texel(self) -> [f32; 4] {
        [self.threshold, f32::from_bits(self.alias), self.probability, f32::from_bits(self.key)]
    }
}

impl LightGrid {
    /// Chooses a grid for the lights of a tree, and fills it: the entries of all cells, x running fastest.
    pub fn of(tree: &LightTree) -> (Self, Vec<[f32; 4]>) {
        let lights = tree.nodes.len().div_ceil(2);
        let entries = lights.next_power_of_two().min(MOST_ENTRIES);
        let cells = if lights == 1 { 1 } else { ((ENTRIES / entries) as f64).cbrt().min(f64::from(MOST_CELLS)) as u32 };
        let (center, size) = middle(tree);
        let depth = if lights > entries { tree.depth } else { 0 };
        let grid = Self { cells, entries: entries as u32, depth, center, size };
        let texels = (0..cells.pow(3))
            .into_par_iter()
            .flat_map_iter(|i| {
                let cell = grid.cell([i % cells, i / cells % cells, i / cells / cells]);
                grid.entries_of(&cell, tree).into_iter().map(Entry::texel)
            })
            .collect();
        (grid, texels)
    }

    /// Loop iterations of a shader that makes two choices and finds the entry of a light that was hit by chance, those
    /// in which loops end included.
    pub fn loops(&self) -> u32 {
        let descents = if self.depth > 0 { 2 * (self.depth + 1) } else { 0 };
        let search = if self.entries > 1 { self.entries.ilog2() + 1 } else { 0 };
        descents + search
    }

    /// Where the lower face of a row of cells is, from the centre.
    fn face(&self, row: u32) -> f64 {
        let t = 2.0 * f64::from(row) / f64::from(self.cells) - 1.0;
        self.size * t / (1.0 - t.abs())
    }

    fn cell(&self, place: [u32; 3]) -> Cell {
        let mut bounded = true;
        let sides = place.map(|row| {
            let (lo, hi) = (self.face(row), self.face(row + 1));
            bounded = bounded && lo.is_finite() && hi.is_finite();
            // What is without end is taken for as large as its distance.
            match (lo.is_finite(), hi.is_finite()) {
                (true, true) => (lo, hi),
                (true, false) => (lo, 2.0 * lo + self.size),
                (false, true) => (2.0 * hi - self.size, hi),
                (false, false) => (-self.size, self.size),
            }
        });
        let [lo, hi] = [sides.map(|s| s.0), sides.map(|s| s.1)].map(DVec3::from);
        Cell { center: self.center + (lo + hi) / 2.0, radius: (hi - lo).length() / 2.0, bounded }
    }

    /// The entries of a cell, sorted by their keys.
    fn entries_of(&self, cell: &Cell, tree: &LightTree) -> Vec<Entry> {
        let entries = self.entries as usize;
        let mut weights: Vec<(u32, f64)> = if self.depth == 0 {
            tree.nodes.iter().filter_map(|n| Some((n.light()?, cell.importance(n)))).collect()
        } else {
            cut(cell, tree, entries)
        };
        weights.retain(|w| w.1 > 0.0);
        weights.sort_unstable_by_key(|w| w.0);
        let sum = |weights: &[(u32, f64)]| weights.iter().map(|w| w.1).sum::<f64>();
        let whole = sum(&weights);
        for w in weights.iter_mut().filter(|w| w.1 > NEGLIGIBLE_SHARE * whole) {
            w.1 = w.1.max(LEAST_SHARE * whole);
        }
        let sum = sum(&weights);
        let shares: Vec<_> = weights.iter().map(|w| w.1 / sum).chain(std::iter::repeat(0.0)).take(entries).collect();
        let keys = weights.iter().map(|w| w.0).chain(std::iter::repeat(NO_KEY));
        let entry = |(column, key): (Column, u32)| Entry {
            threshold: column.threshold,
            alias: column.alias,
            probability: column.share as f32,
            key,
        };
        alias_table(&shares).into_iter().zip(keys).map(entry).collect()
    }
}

/// Where most lights are, and how far from there: a few that are far away shall not make cells coarse for the others.
fn middle(tree: &LightTree) -> (DVec3, f64) {
    let is_near = |n: &&LightNode| n.center().length() < FAR / 2.0;
    let all = || tree.nodes.iter().filter(|n| n.light().is_some());
    // Light from afar is the same in all cells.
    let has_near = all().any(|n| is_near(&n));
    let lights = || all().filter(|n| !has_near || is_near(n));
    let center = DVec3::from([0, 1, 2].map(|axis| {
        let mut places: Vec<_> = lights().map(|n| n.center()[axis]).collect();
        places.sort_unstable_by(f64::total_cmp);
        (places[(places.len() - 1) / 2] + places[places.len() / 2]) / 2.0
    }));
    let mut distances: Vec<_> = lights().map(|n| ((n.center() - center).abs() + n.half_size()).max_element()).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let distance = distances[3 * distances.len() / 4];
    // Cells must be larger than the shader's rounding of coordinates. Render space has a size of about 1.
    (center, distance.max(1e-4 * center.abs().max_element()).max(1e-6))
}

impl LightNode {
    fn light(&self) -> Option<u32> {
        match self.link {
            Link::Light(light) => Some(light),
            Link::Inner { .. } => None,
        }
    }
}

/// A node of the tree that may be divided.
struct Open {
    node: u32,
    importance: f64,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.importance.total_cmp(&other.importance).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

/// Nodes that together have all lights that may shine into the cell, and their importance: what counts most is divided.
fn cut(cell: &Cell, tree: &LightTree, most: usize) -> Vec<(u32, f64)> {
    let open = |node: u32| Open { node, importance: cell.importance(&tree.nodes[node as usize]) };
    let mut heap = BinaryHeap::from([open(0)]);
    let mut done = Vec::with_capacity(most);
    while let Some(top) = heap.pop() {
        match tree.nodes[top.node as usize].link {
            Link::Inner { second, .. } if heap.len() + done.len() + 2 <= most => {
                heap.extend([open(top.node + 1), open(second)].into_iter().filter(|o| o.importance > 0.0));
            }
            _ => done.push((top.node, top.importance)),
        }
    }
    done
}

/// A cell, as a sphere.
struct Cell {
    center: DVec3,
    radius: f64,
    /// It has an end on all sides.
    bounded: bool,
}

impl Cell {
    /// What the lights of a node may contribute to a surface in the cell, about. 0 only if none can.
    fn importance(&self, node: &LightNode) -> f64 {
        let to_cell = self.center - node.center();
        let d2 = to_cell.length_squared();
        let near2 = self.radius * self.radius + node.half_size().length_squared();
        node.strength * self.emission(node, to_cell) / d2.max(near2)
    }

    /// Bound on the cosine at the lights; a little more than that.
    fn emission(&self, node: &LightNode, to_cell: DVec3) -> f64 {
        let d = to_cell.length();
        // Of a way from a light to the surface, around the way from centre to centre. Cells are taken for a little larger
        // than they are, since the shader rounds.
        let apart = 1.01 * self.radius + node.half_size().length();
        if !self.bounded || d <= apart || node.cone.angle >= PI {
            return 1.0;
        }
        let (sin, cos) = node.cone.angle.sin_cos();
        let at_axis = node.cone.axis.dot(to_cell) / d;
        let at_cone = cos_difference(at_axis, cos, sin);
        let sin = apart / d;
        let cosine = cos_difference(at_cone, (1.0 - sin * sin).sqrt(), sin);
        if cosine < -1e-4 { 0.0 } else { cosine.max(1e-3) }
    }
}

/// cos(max(0, a − b)) of angles in [0, π].
fn cos_difference(cos_a: f64, cos_b: f64, sin_b: f64) -> f64 {
    if cos_a > cos_b { 1.0 } else { cos_a * cos_b + (1.0 - cos_a * cos_a).max(0.0).sqrt() * sin_b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::light::emitter::{Light, LightShape};

    fn emitters(count: usize) -> Vec<Light> {
        let mut random = crate::accel::random_numbers(12);
        let mut at = || f64::from(random()) * 10.0 - 5.0;
        (0..count)
            .map(|i| {
                let p = DVec3::new(at(), at(), at());
                let shape = match i % 3 {
                    0 => LightShape::Point(p),
                    1 => LightShape::Triangle([p, p + DVec3::new(at(), at(), at()), p + DVec3::new(at(), at(), at())]),
                    _ => LightShape::Sphere { center: p, radius: 0.5, inward: i % 2 == 0 },
                };
                Light::new(shape, [1.0; 3])
            })
            .collect()
    }

    /// Every light that emits towards some point of a cell is below one entry of it, and only one.
    #[test]
    fn no_light_is_lost() {
        for count in [2usize, 5, 64, 65, 700] {
            let lights = emitters(count);
            let tree = LightTree::of(&lights);
            let (grid, texels) = LightGrid::of(&tree);
            assert_eq!(texels.len(), (grid.cells.pow(3) * grid.entries) as usize);
            let mut random = crate::accel::random_numbers(13);
            for _ in 0..300 {
                let far = 10f64.powf(f64::from(random()) * 4.0 - 1.0);
                let p = grid.center + far * DVec3::from([0; 3].map(|_| f64::from(random()) - 0.5));
                let row = |x: f64| {
                    let x = x / grid.size;
                    (((x / (1.0 + x.abs()) + 1.0) / 2.0 * f64::from(grid.cells)) as u32).min(grid.cells - 1)
                };
                let [x, y, z] = (p - grid.center).to_array().map(row);
                let first = ((z * grid.cells + y) * grid.cells + x) * grid.entries;
                let row = &texels[first as usize..][..grid.entries as usize];
                assert!(row.windows(2).all(|w| w[0][3].to_bits() <= w[1][3].to_bits()), "keys are sorted");
                let sum: f32 = row.iter().map(|e| e[2]).sum();
                assert!((sum - 1.0).abs() < 1e-5, "probabilities sum to {sum}");
                let mut covered = vec![0; count];
                for entry in row.iter().filter(|e| e[2] > 0.0) {
                    let key = entry[3].to_bits();
                    if grid.depth == 0 {
                        covered[key as usize] += 1;
                        continue;
                    }
                    let end = match tree.nodes[key as usize].link {
                        Link::Light(_) => key + 1,
                        Link::Inner { end, .. } => end,
                    };
                    for light in tree.nodes[key as usize..end as usize].iter().filter_map(LightNode::light) {
                        covered[light as usize] += 1;
                    }
                }
                for (light, &n) in lights.iter().zip(&covered) {
                    let shines = match light.shape {
                        LightShape::Triangle([a, b, c]) => (b - a).cross(c - a).dot(p - a) > 0.0,
                        _ => true,
                    };
                    assert!(n == 1 || (n == 0 && !shines), "{light:?} has {n} entries at {p}");
                }
            }
        }
    }

    fn point(p: DVec3, radiance: f64) -> Light {
        Light::new(LightShape::Point(p), [radiance; 3])
    }

    #[test]
    fn one_light_far_away_does_not_make_cells_coarse() {
        let mut lights = emitters(60);
        lights.push(point(DVec3::splat(1e4), 1e9));
        let (grid, _) = LightGrid::of(&LightTree::of(&lights));
        assert!(grid.center.length() < 3.0 && grid.size < 20.0, "{grid:?}");
    }

    #[test]
    fn weak_lights_have_shares_that_random_numbers_can_tell() {
        for weak in [1e-3, 1e-9, 1e-12] {
            let lights = [point(DVec3::ZERO, 1.0), point(DVec3::X, weak)];
            let (_, texels) = LightGrid::of(&LightTree::of(&lights));
            let least = texels.iter().map(|entry| entry[2]).fold(1.0, f32::min);
            assert!(f64::from(least) > 0.99 * LEAST_SHARE, "{least} for {weak}");
        }
    }
}
